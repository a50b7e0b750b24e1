/** Bytes as rows of sixteen: offset, hexadecimal, and the characters that can be printed. */
const ROW = 16
const MAX_BYTES = 512

export function hexDump(data: ArrayBuffer): string {
  const bytes = new Uint8Array(data, 0, Math.min(data.byteLength, MAX_BYTES))
  const rows: string[] = []
  for (let offset = 0; offset < bytes.length; offset += ROW) {
    const row = [...bytes.subarray(offset, offset + ROW)]
    const hex = row.map((byte) => byte.toString(16).padStart(2, '0')).join(' ')
    const characters = row.map((byte) => (byte >= 32 && byte < 127 ? String.fromCharCode(byte) : '.')).join('')
    rows.push(`${offset.toString(16).padStart(4, '0')}  ${hex.padEnd(ROW * 3 - 1)}  ${characters}`)
  }
  if (data.byteLength > MAX_BYTES) rows.push(`… ${data.byteLength - MAX_BYTES} more bytes`)
  return rows.join('\n')
}
