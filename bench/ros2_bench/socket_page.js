// A page that shows what a bridge sends over a WebSocket: JSON with base64, or CDR by Foxglove's protocol.
;(() => {
  const paint = (() => {
    const canvas = document.body.appendChild(document.createElement('canvas'))
    const onto = canvas.getContext('2d', { alpha: false })
    return (width, height, bgr) => {
      if (canvas.width !== width) Object.assign(canvas, { width, height })
      const image = onto.createImageData(width, height)
      const rgba = new Uint32Array(image.data.buffer)
      for (let pixel = 0, at = 0; pixel < rgba.length; pixel++, at += 3)
        rgba[pixel] = 0xff000000 | (bgr[at] << 16) | (bgr[at + 1] << 8) | bgr[at + 2]
      onto.putImageData(image, 0, 0)
    }
  })()

  /** The numbers of a cloud, in a memory of their own. */
  const pointsOf = (bytes) => new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength))

  const shown = (seen, { kind, stampS, width, height, bytes }) => {
    if (kind === 'image') paint(width, height, bytes)
    else pointsOf(bytes)
    seen[kind].push([performance.now(), stampS])
  }

  const bytesOf = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))

  const ofJson = (text) => {
    const { topic, msg } = JSON.parse(text)
    const { sec, nanosec } = msg.header.stamp
    const kind = topic === '/image' ? 'image' : 'cloud'
    return { kind, stampS: sec + nanosec / 1e9, width: msg.width, height: msg.height, bytes: bytesOf(msg.data) }
  }

  /** Reads just the fields that are needed of an Image or a PointCloud2, whose body begins at `at`. */
  const ofCdr = (buffer, at, kind) => {
    const view = new DataView(buffer, at + 4)
    let place = 0
    const number = () => {
      place += -place & 3
      place += 4
      return view.getUint32(place - 4, true)
    }
    const skip = (count) => void (place += count)
    const stampS = number() + number() / 1e9
    skip(number()) // frame_id
    const [height, width] = [number(), number()]
    if (kind === 'image') {
      skip(number()) // encoding
      skip(1) // is_bigendian
      number() // step
    } else {
      for (let fields = number(); fields > 0; fields--) {
        skip(number()) // name
        number() // offset
        skip(1) // datatype
        number() // count
      }
      skip(1) // is_bigendian
      number() // point_step
      number() // row_step
    }
    const size = number()
    return { kind, stampS, width, height, bytes: new Uint8Array(buffer, at + 4 + place, size) }
  }

  const opened = (socket) =>
    new Promise((done, fail) => {
      socket.onopen = done
      socket.onerror = () => fail(new Error('the bridge takes no connection'))
    })

  window.watchJson = async (url) => {
    const seen = (window.seen = { image: [], cloud: [], bytes: 0 })
    const socket = new WebSocket(url)
    socket.onmessage = ({ data }) => {
      seen.bytes += data.length
      shown(seen, ofJson(data))
    }
    await opened(socket)
  }

  window.watchFoxglove = async (url) => {
    const seen = (window.seen = { image: [], cloud: [], bytes: 0 })
    const socket = new WebSocket(url, ['foxglove.sdk.v1'])
    socket.binaryType = 'arraybuffer'
    const kinds = {}
    socket.onmessage = ({ data }) => {
      if (typeof data === 'string') {
        const { op, channels = [] } = JSON.parse(data)
        if (op !== 'advertise') return
        const subscriptions = channels.map(({ id, topic }) => {
          kinds[id] = topic === '/image' ? 'image' : 'cloud'
          return { id, channelId: id }
        })
        socket.send(JSON.stringify({ op: 'subscribe', subscriptions }))
        return
      }
      const view = new DataView(data)
      if (view.getUint8(0) !== 1) return // messages alone: subscription, time, payload
      seen.bytes += data.byteLength
      shown(seen, ofCdr(data, 13, kinds[view.getUint32(1, true)]))
    }
    await opened(socket)
  }
})()
