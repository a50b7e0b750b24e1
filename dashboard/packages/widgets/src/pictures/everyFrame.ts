/** Tells of every picture that is put on the screen. */
export function onEveryFrame(
  video: HTMLVideoElement,
  listener: (nowMs: number, frame?: VideoFrameCallbackMetadata) => void,
): () => void {
  if (!('requestVideoFrameCallback' in video)) return onTimeUpdate(video, () => listener(performance.now()))
  let handle = 0
  const next = () => {
    handle = video.requestVideoFrameCallback((_now, frame) => {
      listener(performance.now(), frame)
      next()
    })
  }
  next()
  return () => video.cancelVideoFrameCallback(handle)
}

/** Older browsers only say that the picture moved on; enough to tell a live picture from a frozen one. */
function onTimeUpdate(video: HTMLElement, listener: () => void): () => void {
  video.addEventListener('timeupdate', listener)
  return () => video.removeEventListener('timeupdate', listener)
}
