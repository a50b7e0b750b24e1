import { Title } from '@mantine/core'
import { Link } from 'react-router-dom'
import { Brand } from '../shell/Brand'
import { ColorSchemeToggle } from '../shell/ColorSchemeToggle'
import { useTitle } from '../shell/useTitle'
import classes from './share.module.css'
import { ShareForm } from './ShareForm'
import { Sharing } from './Sharing'
import { useShare } from './useShare'

export interface SharePageProps {
  /** The one-time code that the page was opened with. */
  code: string | null
}

/** Makes a robot of the device that it is opened on, for as long as it is open and somebody wants it. */
export default function SharePage({ code }: SharePageProps) {
  const share = useShare(code)
  useTitle(share.robot === null ? 'Use this device as a robot' : 'Sharing')
  return (
    <div className={classes.page}>
      <header className={classes.header}>
        {share.robot === null ? (
          <Link to="/" className={classes.home} aria-label="MOSAIC: all robots">
            <Brand />
          </Link>
        ) : (
          <Brand />
        )}
        <ColorSchemeToggle />
      </header>
      <main className={classes.main}>
        {share.robot === null || share.known === null ? (
          <>
            <Title order={1} size="h3">
              Use this device as a robot
            </Title>
            <ShareForm share={share} />
          </>
        ) : (
          <Sharing share={share} robot={share.robot} known={share.known} />
        )}
      </main>
    </div>
  )
}
