/** Decodes clouds beside the page. */
import { decodeCloud } from '../clouds/compactCloud'
import type { DecodedCloud } from './CloudDecoder'

addEventListener('message', (event: MessageEvent<{ id: number; data: ArrayBuffer }>) => {
  const { id, data } = event.data
  decodeCloud(data).then(
    (cloud) => {
      const buffers = [cloud.positions, cloud.intensities, cloud.colours].flatMap((array) => (array === null ? [] : [array.buffer]))
      postMessage({ id, cloud } satisfies DecodedCloud, { transfer: buffers })
    },
    (error: unknown) => postMessage({ id, problem: error instanceof Error ? error.message : String(error) } satisfies DecodedCloud),
  )
})
