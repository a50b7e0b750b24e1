// Several videos of one peer connection: watched, or sent as canvases of moving noise. With marks.js.
;(() => {
  const gathered = (peer) =>
    new Promise((done) => {
      if (peer.iceGatheringState === 'complete') done()
      peer.onicegatheringstatechange = () => peer.iceGatheringState === 'complete' && done()
      setTimeout(done, 1500)
    })

  const watch = (video, displayed) => {
    const note = (_, { expectedDisplayTime }) => {
      const marks = window.readMarks(video)
      displayed.push([expectedDisplayTime, marks?.frame ?? null, marks?.ticks ?? null, video.videoHeight, null])
      video.requestVideoFrameCallback(note)
    }
    video.requestVideoFrameCallback(note)
  }

  window.offerToWatch = async (count, hasSensor) => {
    const peer = (window.peer = new RTCPeerConnection())
    window.sensorBytes = 0
    if (hasSensor) peer.createDataChannel('sensor').onmessage = ({ data }) => (window.sensorBytes += data.byteLength ?? data.size)
    window.displayed = []
    for (let number = 0; number < count; number++) {
      peer.addTransceiver('video', { direction: 'recvonly' })
      window.displayed.push([])
    }
    peer.ontrack = ({ receiver, track, transceiver }) => {
      const video = document.body.appendChild(document.createElement('video'))
      Object.assign(video, { muted: true, autoplay: true, playsInline: true, width: 320 })
      receiver.jitterBufferTarget = 0 // as the dashboard does for driving
      video.srcObject = new MediaStream([track])
      void video.play()
      watch(video, window.displayed[peer.getTransceivers().indexOf(transceiver)])
    }
    await peer.setLocalDescription()
    await gathered(peer)
    return peer.localDescription.sdp
  }

  window.offerBulk = async () => {
    const peer = (window.bulk = new RTCPeerConnection())
    window.bulkBytes = 0
    peer.createDataChannel('bulk').onmessage = ({ data }) => (window.bulkBytes += data.byteLength ?? data.size)
    await peer.setLocalDescription()
    await gathered(peer)
    return peer.localDescription.sdp
  }

  window.answerWithBulk = async (sdp) => {
    const peer = (window.bulk = new RTCPeerConnection())
    peer.ondatachannel = ({ channel }) => {
      const refill = () => {
        while (channel.bufferedAmount < 65536) channel.send(new Uint8Array(16384))
      }
      channel.bufferedAmountLowThreshold = 32768
      channel.onbufferedamountlow = refill
      refill()
    }
    await peer.setRemoteDescription({ type: 'offer', sdp })
    await peer.setLocalDescription()
    await gathered(peer)
    return peer.localDescription.sdp
  }

  const speckled = (width, height, levels) => {
    const canvas = new OffscreenCanvas(width, height)
    const onto = canvas.getContext('2d')
    const pixels = onto.createImageData(width, height)
    for (let i = 0; i < pixels.data.length; i++) pixels.data[i] = i % 4 === 3 ? 255 : Math.random() * levels
    onto.putImageData(pixels, 0, 0)
    return canvas
  }

  const noise = (width, height) => {
    const small = speckled(width / 8, height / 8, 256)
    const large = new OffscreenCanvas(width, height)
    const scaled = large.getContext('2d')
    scaled.imageSmoothingEnabled = false
    scaled.drawImage(small, 0, 0, width, height)
    return large
  }

  window.answerWithNoise = async ({ sdp, count, width, height, fps, offsetMs }) => {
    const peer = (window.peer = new RTCPeerConnection())
    const films = Array.from({ length: count }, () => {
      const canvas = document.body.appendChild(document.createElement('canvas'))
      Object.assign(canvas, { width, height })
      const stream = canvas.captureStream(0)
      return { onto: canvas.getContext('2d', { alpha: false }), stream, track: stream.getVideoTracks()[0] }
    })
    const sensor = Array.from({ length: 7 }, () => speckled(width, height, 12))
    const cut = (window.cut = () => films.forEach((film) => (film.noise = noise(width, height))))
    cut()
    await peer.setRemoteDescription({ type: 'offer', sdp })
    for (const { track, stream } of films) peer.addTrack(track, stream)
    await peer.setLocalDescription()
    await gathered(peer)
    films.forEach((film) => {
      let frame = 0
      const draw = () => {
        const left = (frame * 2) % width
        const capturedMs = performance.now() + offsetMs
        film.onto.drawImage(film.noise, -left, 0)
        film.onto.drawImage(film.noise, width - left, 0)
        film.onto.globalCompositeOperation = 'lighter'
        film.onto.drawImage(sensor[frame % 7], 0, 0)
        film.onto.globalCompositeOperation = 'source-over'
        window.drawMarks(film.onto, width, height, frame++, Math.round(capturedMs * 10) % 2 ** 32)
        film.track.requestFrame()
      }
      setTimeout(() => setInterval(draw, 1000 / fps), (Math.random() * 1000) / fps)
    })
    return peer.localDescription.sdp
  }
})()
