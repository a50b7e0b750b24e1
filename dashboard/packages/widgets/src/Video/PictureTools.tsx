import { ActionIcon, Menu, Tooltip } from '@mantine/core'
import {
  IconCamera,
  IconCheck,
  IconDotsVertical,
  IconDownload,
  IconInfoCircle,
  IconMaximize,
  IconPlayerRecordFilled,
  IconPlayerStopFilled,
  IconScan,
} from '@tabler/icons-react'
import { type ReactNode } from 'react'
import type { Buffering, PictureChoices } from '../pictures/pictureChoices'
import classes from './Video.module.css'

export interface PictureToolsProps {
  label: string
  hasPicture: boolean
  /** Something may be marked in it. */
  hasMarks: boolean
  choices: PictureChoices
  onChoose: (choices: PictureChoices) => void
  isRecording: boolean
  /** Null where this browser can't record. */
  onRecord: (() => void) | null
  onStill: () => void
  onExport: (format: 'csv' | 'json') => void
  onFullscreen: () => void
}

/** What can be done with a picture. */
export function PictureTools(props: PictureToolsProps) {
  const { label, hasPicture, hasMarks, choices, onChoose, isRecording, onRecord, onStill, onFullscreen } = props
  return (
    <div className={classes.tools} role="group" aria-label={`Tools for ${label}`}>
      {onRecord !== null && (
        <Tool
          label={isRecording ? 'End the recording and save it' : 'Record here, in this browser'}
          isOn={isRecording}
          isDisabled={!hasPicture && !isRecording}
          onPress={onRecord}
        >
          {isRecording ? <IconPlayerStopFilled size={16} /> : <IconPlayerRecordFilled size={16} />}
        </Tool>
      )}
      <Tool label="Save this picture (PNG)" isDisabled={!hasPicture} onPress={onStill}>
        <IconCamera size={16} />
      </Tool>
      <Tool
        label={choices.showsDetails ? 'Hide the figures' : 'Show all figures'}
        isOn={choices.showsDetails}
        onPress={() => onChoose({ ...choices, showsDetails: !choices.showsDetails })}
      >
        <IconInfoCircle size={16} />
      </Tool>
      {hasMarks && (
        <Tool
          label={choices.showsMarks ? 'Hide the marks' : 'Show what is marked'}
          isOn={choices.showsMarks}
          onPress={() => onChoose({ ...choices, showsMarks: !choices.showsMarks })}
        >
          <IconScan size={16} />
        </Tool>
      )}
      <MoreTools {...props} />
      <Tool label={`Show ${label} on the whole screen`} onPress={onFullscreen}>
        <IconMaximize size={16} />
      </Tool>
    </div>
  )
}

interface ToolProps {
  label: string
  isOn?: boolean
  isDisabled?: boolean
  onPress?: () => void
  children: ReactNode
}

function Tool({ label, isOn, isDisabled = false, onPress, children }: ToolProps) {
  return (
    <Tooltip label={label} openDelay={300}>
      <ActionIcon
        className={classes.tool}
        size={32}
        aria-label={label}
        aria-pressed={isOn}
        disabled={isDisabled}
        onClick={onPress}
      >
        {children}
      </ActionIcon>
    </Tooltip>
  )
}

const BUFFERINGS: { buffering: Buffering; title: string; text: string }[] = [
  { buffering: 'drive', title: 'Drive', text: 'the newest picture, even if it stutters' },
  { buffering: 'inspect', title: 'Inspect', text: 'smooth, a quarter of a second later' },
  { buffering: 'auto', title: 'Automatic', text: 'as the robot asks or the browser likes' },
]

function MoreTools({ label, choices, onChoose, onExport }: PictureToolsProps) {
  return (
    <Menu position="top-end" shadow="md" withinPortal={false}>
      <Menu.Target>
        <ActionIcon className={classes.tool} size={32} aria-label={`More for ${label}`}>
          <IconDotsVertical size={16} />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Label>Picture for</Menu.Label>
        {BUFFERINGS.map(({ buffering, title, text }) => (
          <Menu.Item
            key={buffering}
            aria-current={buffering === choices.buffering ? 'true' : undefined}
            leftSection={buffering === choices.buffering ? <IconCheck size={16} /> : <span className={classes.noCheck} />}
            onClick={() => onChoose({ ...choices, buffering })}
          >
            {title}: {text}
          </Menu.Item>
        ))}
        <Menu.Divider />
        <Menu.Label>Figures, second by second</Menu.Label>
        <Menu.Item leftSection={<IconDownload size={16} />} onClick={() => onExport('csv')}>
          Save as CSV
        </Menu.Item>
        <Menu.Item leftSection={<IconDownload size={16} />} onClick={() => onExport('json')}>
          Save as JSON
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  )
}
