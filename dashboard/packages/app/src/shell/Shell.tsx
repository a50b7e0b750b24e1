import { ActionIcon, Tooltip } from '@mantine/core'
import { useMosaicClient, useReadable } from '@mosaic/react'
import { IconLogout } from '@tabler/icons-react'
import type { ReactNode } from 'react'
import { Link } from 'react-router-dom'
import { Brand } from './Brand'
import { ColorSchemeToggle } from './ColorSchemeToggle'
import { ServerBanner } from './ServerBanner'
import classes from './shell.module.css'

export interface ShellProps {
  /** What the page puts into the header. */
  header?: ReactNode
  /** What the page adds beside the account. */
  menu?: ReactNode
  /** What it has to say above everything else. */
  notice?: ReactNode
  children: ReactNode
}

/** The frame of every page of a signed-in operator. */
export function Shell({ header, menu, notice, children }: ShellProps) {
  return (
    <div className={classes.shell}>
      <a className={classes.skip} href="#main">
        Skip to content
      </a>
      <header className={classes.header} data-compact={header !== undefined}>
        <Link to="/" className={classes.home} aria-label="MOSAIC: all robots">
          <Brand />
        </Link>
        <div className={classes.slot}>{header}</div>
        {menu}
        <Account />
        <span className={classes.global}>
          <ColorSchemeToggle />
          <SignOut />
        </span>
      </header>
      <div className={classes.notices} data-over={header !== undefined}>
        <ServerBanner />
        {notice}
      </div>
      <main id="main" className={classes.main} tabIndex={-1}>
        {children}
      </main>
    </div>
  )
}

function Account() {
  const session = useReadable(useMosaicClient().session)
  return <span className={classes.account}>{session?.user.fullName || session?.user.email}</span>
}

function SignOut() {
  const client = useMosaicClient()
  return (
    <Tooltip label="Sign out" openDelay={400}>
      <ActionIcon variant="subtle" color="gray" size={36} aria-label="Sign out" onClick={() => client.logout()}>
        <IconLogout size={18} stroke={1.6} />
      </ActionIcon>
    </Tooltip>
  )
}
