// The marks of mosaic_camera/marks.py in a page: read from a <video>, drawn into a canvas.
;(() => {
  const VALUE_BITS = 32
  const COLUMNS = 40
  const MARKS_SHARE = 2 / 30 // of the picture's height, both rows
  const CELL_PX = 4
  const SALT = [...'mosaic'].map((letter) => letter.charCodeAt(0))

  const crc32 = (bytes) => {
    let crc = ~0
    for (const byte of bytes) {
      crc ^= byte
      for (let bit = 0; bit < 8; bit++) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0)
    }
    return ~crc >>> 0
  }
  const bytesOf = (value) => [24, 16, 8, 0].map((shift) => (value >>> shift) & 0xff)
  const checkOf = (value) => crc32([...bytesOf(value), ...SALT]) & 0xff

  const strip = document.createElement('canvas')
  strip.width = COLUMNS * CELL_PX
  strip.height = 2 * CELL_PX
  const context = strip.getContext('2d', { willReadFrequently: true })
  context.imageSmoothingEnabled = false // the centre of a block, not a mean over its edges

  const rowOf = (rgba, row) => {
    const centreOf = (column) => 4 * ((row * CELL_PX + CELL_PX / 2) * strip.width + column * CELL_PX + CELL_PX / 2)
    let value = 0
    let check = 0
    for (let column = 0; column < COLUMNS; column++) {
      const at = centreOf(column)
      const bit = rgba[at] + rgba[at + 1] + rgba[at + 2] > 3 * 127 ? 1 : 0
      if (column < VALUE_BITS) value = ((value << 1) | bit) >>> 0
      else check = (check << 1) | bit
    }
    return check === checkOf(value) ? value : null
  }

  /** Frame number and capture time (tenths of a millisecond) of the displayed picture; null where a check fails. */
  window.readMarks = (video) => {
    const { videoWidth: width, videoHeight: height } = video
    if (!width) return null
    context.drawImage(video, 0, height * (1 - MARKS_SHARE), width, height * MARKS_SHARE, 0, 0, strip.width, strip.height)
    const { data } = context.getImageData(0, 0, strip.width, strip.height)
    const frame = rowOf(data, 0)
    const ticks = rowOf(data, 1)
    return frame === null || ticks === null ? null : { frame, ticks }
  }

  window.drawMarks = (onto, width, height, frame, ticks) => {
    const size = Math.max(8, Math.floor(height / 30))
    ;[frame, ticks].forEach((value, row) => {
      for (let column = 0; column < COLUMNS; column++) {
        const check = checkOf(value)
        const bit = column < VALUE_BITS ? (value >>> (VALUE_BITS - 1 - column)) & 1 : (check >>> (COLUMNS - 1 - column)) & 1
        const left = Math.ceil((column * width) / COLUMNS)
        onto.fillStyle = bit ? '#fff' : '#000'
        onto.fillRect(left, height - (2 - row) * size, Math.ceil(((column + 1) * width) / COLUMNS) - left, size)
      }
    })
  }
})()
