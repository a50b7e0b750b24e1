/**
 * The media lines that an answer rejects: port zero (RFC 3264 §6), which means that no codec is shared. A line that is
 * merely not used has a port and is inactive.
 */
export function rejectedMids(sdp: string): string[] {
  const [, ...sections] = sdp.split(/^m=/m)
  return sections.flatMap((section) => {
    const isRejected = /^(?:audio|video) 0 /.test(section)
    const mid = /^a=mid:(\S+)/m.exec(section)?.[1]
    return isRejected && mid !== undefined ? [mid] : []
  })
}
