import type { VoicePlayer } from '../connectors/Loudspeaker'

/** Plays a voice aloud. It may, as whoever shares this device has pressed a button. */
export function audioPlayer(track: MediaStreamTrack): VoicePlayer {
  const element = new Audio()
  element.srcObject = new MediaStream([track])
  element.autoplay = true
  return {
    mute: (isMuted) => void (element.muted = isMuted),
    end: () => {
      element.pause()
      element.srcObject = null
    },
  }
}
