/** The smallest file that brings a robot of this server online, ready to paste. */
import type { RobotCredentials } from '@mosaic/robot'

export function robotYaml(origin: string, { robotId, token }: RobotCredentials): string {
  return `version: 1
server:
  ws_url: ${origin.replace(/^http/, 'ws')}
  auth:
    type: simple-token
    robot_id: ${robotId}
    params: { token: ${token} }
connectors:
  - { type: camera, label: front, params: { source: /dev/video0 } }
  - { type: host-load, label: host }
  - { type: connection-check, label: link }
`
}
