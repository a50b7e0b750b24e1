import type { Gap } from '@mosaic/client'

/** That messages are lost, in words. */
export function gapText({ lost, sent }: Gap): string {
  if (sent) return lost === 1 ? '1 message may not have arrived' : `${lost ?? 'Some'} messages may not have arrived`
  if (lost === null) return 'Messages were lost while the connection was away'
  return `${lost} ${lost === 1 ? 'message was' : 'messages were'} lost while the connection was away`
}
