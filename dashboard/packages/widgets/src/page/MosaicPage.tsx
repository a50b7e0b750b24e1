import { MantineProvider, Paper, Title } from '@mantine/core'
import type { MosaicClient } from '@mosaic/client'
import { MosaicProvider, useMosaicClient, useReadable } from '@mosaic/react'
import { useEffect, type ReactNode } from 'react'
import { cssVariables, theme } from '../theme/theme'
import { failureOf } from './failure'
import classes from './page.module.css'
import { SignInForm } from './SignInForm'

/** What `MosaicPage` takes. */
export interface MosaicPageProps {
  client: MosaicClient
  /** Shown once somebody is signed in. */
  children: ReactNode
}

/** A whole page around its `children`: what hooks and widgets need above them, in the browser's colours, and a sign-in. */
export function MosaicPage({ client, children }: MosaicPageProps) {
  return (
    <MosaicProvider client={client}>
      <MantineProvider theme={theme} cssVariablesResolver={cssVariables} defaultColorScheme="auto">
        <SignedIn>{children}</SignedIn>
      </MantineProvider>
    </MosaicProvider>
  )
}

/** Who signed in before need not do so again. */
function SignedIn({ children }: { children: ReactNode }) {
  const client = useMosaicClient()
  const session = useReadable(client.session)
  const ended = useReadable(client.sessionError)
  const isRestoring = useReadable(client.restoring)
  useEffect(() => {
    // React's second mount must not do it twice.
    if (!restored.has(client)) void client.restore()
    restored.add(client)
  }, [client])
  if (session !== null) return children
  if (isRestoring) return null
  return (
    <main className={classes.signIn}>
      <Paper className={classes.panel} withBorder p="xl" radius="md">
        <SignInForm key={ended?.code} firstFailure={ended && failureOf(ended)}>
          <Title order={1} size="h3">
            Sign in
          </Title>
        </SignInForm>
      </Paper>
    </main>
  )
}

const restored = new WeakSet<MosaicClient>()
