import { Paper } from '@mantine/core'
import { useState } from 'react'
import { useTitle } from '../shell/useTitle'
import { ColorSchemeToggle } from '../shell/ColorSchemeToggle'
import type { Failure } from '@mosaic/widgets'
import { PairForm } from './PairForm'
import { PasswordForm } from './PasswordForm'
import classes from './SignInPage.module.css'
import { usePairsWith } from './usePairsWith'

export interface SignInPageProps {
  /** Why a one-time code did not sign in, or why the last session ended. */
  firstFailure: Failure | null
}

/** By e-mail and password; where the server belongs to one robot, by its PIN. */
export function SignInPage({ firstFailure }: SignInPageProps) {
  const robot = usePairsWith()
  const [wantsPassword, setWantsPassword] = useState(false)
  useTitle(typeof robot === 'string' ? `Pair with ${robot}` : 'Sign in')
  return (
    <main className={classes.root}>
      <div className={classes.corner}>
        <ColorSchemeToggle />
      </div>
      {robot !== undefined && (
        <Paper className={classes.panel} withBorder p="xl" radius="md">
          {robot === null || wantsPassword ? (
            <PasswordForm firstFailure={wantsPassword ? null : firstFailure} />
          ) : (
            <PairForm robot={robot} firstFailure={firstFailure} onPassword={() => setWantsPassword(true)} />
          )}
        </Paper>
      )}
    </main>
  )
}
