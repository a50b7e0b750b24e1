import { Title } from '@mantine/core'
import type { RobotSummary } from '@mosaic/client'
import { useEffect } from 'react'
import classes from './describe.module.css'
import { DescribeRobot } from './DescribeRobot'

/** In place of the cards of a robot that announces nothing and that nobody described yet. */
export default function NotDescribed({ robot }: { robot: RobotSummary }) {
  // Its cards take this place: whoever had scrolled down to the last button would not see the picture to drive by.
  useEffect(() => () => window.scrollTo({ top: 0 }), [])
  return (
    <div className={classes.page}>
      <header>
        <Title order={2} size="h4">
          This robot does not say what it has
        </Title>
        <p className={classes.intro}>
          It runs an original MOSAIC, which announces nothing. Say it once: it is kept on the server, and everybody who sees this
          robot then has its cards, pictures and drive pad.
        </p>
      </header>
      <DescribeRobot robot={robot} />
    </div>
  )
}
