// Notes every displayed picture: when it is on the screen, and what is burnt into it.
;(() => {
  window.watchVideo = (video, more = () => null) => {
    const displayed = (window.displayed = [])
    const note = (_, frame) => {
      const { expectedDisplayTime: atMs, rtpTimestamp = null } = frame
      const marks = window.readMarks(video)
      displayed.push([atMs, marks?.frame ?? null, marks?.ticks ?? null, video.videoHeight, more(rtpTimestamp, atMs)])
      video.requestVideoFrameCallback(note)
    }
    video.requestVideoFrameCallback(note)
  }

  const gathered = (peer) =>
    new Promise((done) => {
      if (peer.iceGatheringState === 'complete') done()
      peer.onicegatheringstatechange = () => peer.iceGatheringState === 'complete' && done()
      setTimeout(done, 1500)
    })

  /** The page as an operator of one video line; resolves to its offer with all candidates. */
  window.offerToWatch = async () => {
    const peer = (window.peer = new RTCPeerConnection())
    peer.addTransceiver('video', { direction: 'recvonly' })
    const video = document.body.appendChild(document.createElement('video'))
    Object.assign(video, { muted: true, autoplay: true, playsInline: true })
    peer.ontrack = (event) => {
      // As the dashboard does for driving.
      event.receiver.jitterBufferTarget = 0
      video.srcObject = new MediaStream([event.track])
      void video.play()
      window.watchVideo(video)
    }
    await peer.setLocalDescription()
    await gathered(peer)
    return peer.localDescription.sdp
  }

  /** The page as a robot: a canvas that moves, with marks of the clock that `offsetMs` leads to. */
  window.answerWithCanvas = async ({ sdp, width, height, fps, background, offsetMs }) => {
    const peer = (window.peer = new RTCPeerConnection())
    const canvas = document.body.appendChild(document.createElement('canvas'))
    Object.assign(canvas, { width, height })
    const onto = canvas.getContext('2d', { alpha: false })
    const still = new Image()
    still.src = background
    await still.decode()
    const stream = canvas.captureStream(0)
    const [track] = stream.getVideoTracks()
    let frame = 0
    const draw = () => {
      const capturedMs = performance.now() + offsetMs
      onto.drawImage(still, 0, 0)
      const angle = (capturedMs / 4000) * 2 * Math.PI
      const [x, y, radius] = [width / 2, height / 4, height / 5]
      onto.fillStyle = '#202020'
      onto.beginPath()
      onto.arc(x, y, radius, 0, 2 * Math.PI)
      onto.fill()
      onto.strokeStyle = '#ffdc50'
      onto.lineWidth = height / 80
      onto.beginPath()
      onto.moveTo(x, y)
      onto.lineTo(x + radius * Math.sin(angle), y - radius * Math.cos(angle))
      onto.stroke()
      window.drawMarks(onto, width, height, frame++, Math.round(capturedMs * 10) % 2 ** 32)
      track.requestFrame()
    }
    await peer.setRemoteDescription({ type: 'offer', sdp })
    peer.addTrack(track, stream)
    await peer.setLocalDescription()
    await gathered(peer)
    setInterval(draw, 1000 / fps)
    return peer.localDescription.sdp
  }

  const inbound = async () => {
    for (const entry of (await window.peer.getStats()).values()) if (entry.type === 'inbound-rtp') return entry
    return {}
  }

  window.received = async () => {
    const entry = await inbound()
    return { sizeBytes: entry.bytesReceived ?? 0, decoded: entry.framesDecoded ?? 0, freezes: entry.freezeCount ?? 0 }
  }

  /** How many bytes have come so far, ten times a second. */
  window.logBytes = () => {
    const log = (window.bytesLog = [])
    setInterval(async () => log.push([performance.now(), (await inbound()).bytesReceived ?? 0]), 100)
  }
})()
