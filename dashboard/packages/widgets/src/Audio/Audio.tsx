import { ActionIcon, Button, Slider } from '@mantine/core'
import { useReadable } from '@mosaic/react'
import { IconPlayerStop, IconVolume, IconVolumeOff } from '@tabler/icons-react'
import { useEffect, useEffectEvent, useRef, useState } from 'react'
import { Notice } from '../frame/Notice'
import type { WidgetProps } from '../registry/WidgetDefinition'
import { showsMedia, type ShowsMedia } from '../stores/storeKinds'
import classes from './Audio.module.css'
import { QUIET_DB } from './soundLevel'
import { playSound } from './SoundPlayer'

/** What a robot's microphone hears. Browsers play nothing before a click, so one listens on purpose. */
export function Audio({ store, entry }: WidgetProps) {
  if (!showsMedia(store)) return <Notice tone="bad" title="This connector carries no sound" />
  return <Sound store={store} label={entry.label} />
}

const NO_STREAM = { get: () => null, subscribe: () => () => {} }

function Sound({ store, label }: { store: ShowsMedia; label: string }) {
  const [isListening, setIsListening] = useState(false)
  const [volumePercent, setVolumePercent] = useState(100)
  const [isMuted, setIsMuted] = useState(false)
  // Whoever doesn't listen to the store is sent nothing: the robot then captures nothing.
  const stream = useReadable(isListening ? store.mediaStream : NO_STREAM)
  const audio = useRef<HTMLAudioElement>(null)
  const meter = useRef<HTMLDivElement>(null)
  const blocked = useEffectEvent(() => setIsListening(false))
  useEffect(() => {
    if (stream === null || audio.current === null || meter.current === null) return undefined
    return playSound({ audio: audio.current, meter: meter.current }, stream, () => blocked())
  }, [stream])
  useEffect(() => {
    if (audio.current === null) return
    audio.current.volume = volumePercent / 100
    audio.current.muted = isMuted
  }, [volumePercent, isMuted])
  return (
    <div className={classes.root} data-state={stateOf(isListening, stream)} data-testid="audio">
      <audio ref={audio} aria-label={`Sound of ${label}`} />
      <Button
        variant={isListening ? 'light' : 'filled'}
        leftSection={isListening ? <IconPlayerStop size={16} /> : <IconVolume size={16} />}
        aria-pressed={isListening}
        onClick={() => setIsListening(!isListening)}
      >
        {isListening ? 'Stop listening' : 'Listen'}
      </Button>
      <div
        ref={meter}
        className={classes.meter}
        data-muted={isMuted}
        role="meter"
        aria-label="Level in dB"
        aria-valuemin={QUIET_DB}
        aria-valuemax={0}
        aria-valuenow={QUIET_DB}
      />
      <ActionIcon
        variant="subtle"
        color="gray"
        size="lg"
        aria-label="Mute"
        aria-pressed={isMuted}
        onClick={() => setIsMuted(!isMuted)}
      >
        {isMuted ? <IconVolumeOff size={18} /> : <IconVolume size={18} />}
      </ActionIcon>
      <Slider
        className={classes.volume}
        value={volumePercent}
        onChange={setVolumePercent}
        label={(percent) => `${percent} %`}
        thumbLabel="Volume"
      />
    </div>
  )
}

function stateOf(isListening: boolean, stream: MediaStream | null): string {
  return !isListening ? 'off' : stream === null ? 'waiting' : 'on'
}
