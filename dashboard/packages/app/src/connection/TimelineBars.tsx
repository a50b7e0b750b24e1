import type { Timeline } from '@mosaic/client'
import type { CSSProperties } from 'react'
import classes from './connection.module.css'
import { timelineBars } from './timelineBars'

/** How far a connection got, and where its time went. */
export function TimelineBars({ timeline }: { timeline: Timeline }) {
  return (
    <table className={classes.timeline} data-testid="timeline">
      <caption className={classes.hidden}>What happened when, since the connection was asked for</caption>
      <tbody>
        {timelineBars(timeline).map(({ title, at, detail, startPercent, widthPercent, isEnd }) => (
          <tr key={title} data-end={isEnd}>
            <th scope="row">
              {title}
              {detail !== '' && <small className={classes.detail}>{detail}</small>}
            </th>
            <td className={classes.at}>{at}</td>
            <td className={classes.track} aria-hidden>
              <span style={{ '--start': `${startPercent}%`, '--width': `${widthPercent}%` } as CSSProperties} />
            </td>
          </tr>
        ))}
      </tbody>
    </table>
  )
}
