// The same orders as `data_bench/end.py`, carried out by a browser.
(() => {
  // Chromium's best: with 1 MiB nearly every flood begins with seconds of loss (WARM_UP_MOST_S), with 64 KiB few do; once
  // it runs, neither buffers from 64 KiB to 4 MiB nor messages from 16 to 256 KiB make it faster.
  const MOST_BUFFERED_BYTES = 64 * 1024
  const LEAST_BUFFERED_BYTES = 16 * 1024
  const pc = new RTCPeerConnection({ iceServers: [] })
  let channel
  let messages = 0
  let bytes = 0
  let isEchoing = false
  let isFlooding = false
  let echoed = null

  const isOpen = new Promise((resolve) => {
    window.take = (taken) => {
      channel = taken
      channel.binaryType = 'arraybuffer'
      channel.bufferedAmountLowThreshold = LEAST_BUFFERED_BYTES
      channel.onmessage = ({ data }) => {
        messages += 1
        bytes += data.byteLength
        if (isEchoing) channel.send(data)
        else echoed?.(performance.now())
      }
      channel.onopen = resolve
      if (channel.readyState === 'open') resolve()
    }
  })
  pc.ondatachannel = (event) => window.take(event.channel)

  const described = async () => {
    await pc.setLocalDescription()
    if (pc.iceGatheringState !== 'complete') {
      await new Promise((resolve) => {
        pc.onicegatheringstatechange = () => pc.iceGatheringState === 'complete' && resolve()
      })
    }
    return pc.localDescription.sdp
  }

  const flood = async (data) => {
    isFlooding = true
    while (isFlooding) {
      while (channel.bufferedAmount < MOST_BUFFERED_BYTES) channel.send(data)
      await new Promise((resolve) => (channel.onbufferedamountlow = resolve))
    }
  }

  const ping = async (rateHz, count, data) => {
    const sent = []
    const trips = []
    const done = new Promise((resolve) => {
      echoed = (atMs) => {
        trips.push(atMs - sent[trips.length])
        if (trips.length === count) resolve()
      }
    })
    const startMs = performance.now()
    for (let number = 0; number < count; number += 1) {
      const dueMs = startMs + (number * 1000) / rateHz
      while (performance.now() < dueMs) await new Promise((resolve) => setTimeout(resolve, 0))
      sent.push(performance.now())
      channel.send(data)
    }
    await done
    echoed = null
    return trips
  }

  window.obey = async (order) => {
    switch (order.do) {
      case 'offer':
        window.take(pc.createDataChannel('data'))
        return described()
      case 'answer':
        await pc.setRemoteDescription({ type: 'offer', sdp: order.sdp })
        return described()
      case 'accept':
        return pc.setRemoteDescription({ type: 'answer', sdp: order.sdp })
      case 'opened':
        await isOpen
        return null
      case 'echo':
        isEchoing = true
        return null
      case 'flood':
        void flood(new Uint8Array(order.size_bytes))
        return null
      case 'count':
        return [messages, bytes, performance.now() / 1000, null]
      case 'ping':
        return ping(order.rate_hz, order.count, new Uint8Array(order.size_bytes))
      case 'close':
        isFlooding = false
        pc.close()
        return null
    }
  }
})()
