// A page that watches a robot by the dashboard's client: bundled by ros2_bench/pages.py.
import { MediaStreamStore, MosaicClient, ReceivableStore } from '@mosaic/client'
import { decodeCloud } from '../../dashboard/packages/widgets/src/clouds/compactCloud'

declare global {
  interface Window {
    seen: { cloud: [number, number][]; bytes: number }
    watchMosaic: (email: string, password: string, robotId: string) => Promise<void>
    watchVideo: (video: HTMLVideoElement) => void
  }
}

window.watchMosaic = async (email, password, robotId) => {
  const seen = (window.seen = { cloud: [], bytes: 0 })
  const client = new MosaicClient()
  await client.login(email, password, { remember: false })
  client.connection(robotId).connect()
  const { storeManager } = client

  const front = storeManager.getOrCreateStore({ robotId, connectorId: 'front', dataType: 'media' }, MediaStreamStore)
  const video = document.body.appendChild(document.createElement('video'))
  Object.assign(video, { muted: true, autoplay: true, playsInline: true })
  front.setBufferTarget(0) // as the dashboard does for driving
  front.setShown({ sizePx: 640 * 480, leads: true })
  front.mediaStream.subscribe(() => {
    video.srcObject = front.mediaStream.get()
    if (video.srcObject) void video.play()
  })
  window.watchVideo(video)

  const cloud = storeManager.getOrCreateStore({ robotId, connectorId: 'cloud', dataType: 'byte-r2u' }, ReceivableStore)
  cloud.subscribe(async (data) => {
    const { capturedUs } = await decodeCloud(data)
    seen.cloud.push([performance.now(), capturedUs / 1e6])
    seen.bytes += data.byteLength
  })
}
