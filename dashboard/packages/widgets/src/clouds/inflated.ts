/** Deflated bodies of clouds and scans, inflated within the size that their header promises. */

/** Says why data is no point cloud. */
export class CloudError extends Error {
  override name = 'CloudError'
}

/** Never more than `size` bytes and a chunk: a body that inflates without end is left alone. */
export async function inflated(deflated: Uint8Array<ArrayBuffer>, size: number): Promise<Uint8Array<ArrayBuffer>> {
  const out = new Uint8Array(size)
  const reader = new Blob([deflated]).stream().pipeThrough(new DecompressionStream('deflate')).getReader()
  let at = 0
  try {
    for (;;) {
      const { done, value } = await reader.read()
      if (done) return out.subarray(0, at)
      if (at + value.length > size) throw new CloudError('its body is larger than its header says')
      out.set(value, at)
      at += value.length
    }
  } catch (error) {
    void reader.cancel().catch(() => undefined)
    throw error instanceof CloudError ? error : new CloudError('its body cannot be inflated')
  }
}
