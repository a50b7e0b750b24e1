/** Ticks for the page: a worker's timers keep their pace where a page's are throttled. */
const timers = new Map<number, ReturnType<typeof setInterval>>()

addEventListener('message', (event: MessageEvent<{ id: number; periodMs: number | null }>) => {
  const { id, periodMs } = event.data
  clearInterval(timers.get(id))
  timers.delete(id)
  if (periodMs !== null) timers.set(id, setInterval(() => postMessage(id), periodMs))
})
