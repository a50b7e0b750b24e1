/** Small readings of what the server and the robot say about one connection. */
import type { SignalingMessage } from '@mosaic/protocol'

/** Whether a message of the signaling socket belongs to this connection. */
export function isAbout(message: SignalingMessage, rtcConnectionId: string): boolean {
  return 'data' in message && typeof message.data === 'object' && 'rtcConnectionId' in message.data
    ? message.data.rtcConnectionId === rtcConnectionId
    : false
}

/** Code and message, where there are any. */
export function reasonIn({ code, message }: { code?: string; message?: string }): { code?: string; message?: string } {
  return { ...(code === undefined ? {} : { code }), ...(message === undefined ? {} : { message }) }
}
