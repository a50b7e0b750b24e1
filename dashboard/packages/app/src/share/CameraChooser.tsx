import { SegmentedControl } from '@mantine/core'
import { CAMERA_HEIGHTS, type CameraChoice, type Facing } from '@mosaic/robot'
import classes from './share.module.css'

export interface CameraChooserProps {
  choice: CameraChoice
  onChoose: (choice: CameraChoice) => void
}

const FACINGS = [
  { value: 'environment', label: 'Back camera' },
  { value: 'user', label: 'Front camera' },
] as const satisfies readonly { value: Facing; label: string }[]

/** Which camera films, and how large its pictures are. */
export function CameraChooser({ choice, onChoose }: CameraChooserProps) {
  return (
    <div className={classes.camera}>
      <SegmentedControl<Facing>
        aria-label="Camera"
        data={[...FACINGS]}
        value={choice.facing}
        onChange={(facing) => onChoose({ ...choice, facing })}
        fullWidth
      />
      <SegmentedControl
        aria-label="Size of the pictures"
        data={CAMERA_HEIGHTS.map((height) => ({ value: String(height), label: `${height}p` }))}
        value={String(choice.height)}
        onChange={(height) => onChoose({ ...choice, height: Number(height) })}
        fullWidth
      />
    </div>
  )
}
