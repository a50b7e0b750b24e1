/** Ticks for the drive pad: a worker's timers keep their pace where a page's are throttled. */
let timer: ReturnType<typeof setInterval> | undefined

addEventListener('message', (event: MessageEvent<{ periodMs: number | null }>) => {
  clearInterval(timer)
  if (event.data.periodMs !== null) timer = setInterval(() => postMessage(null), event.data.periodMs)
})
