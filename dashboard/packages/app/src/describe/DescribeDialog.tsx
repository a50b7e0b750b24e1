import { Modal } from '@mantine/core'
import type { RobotSummary } from '@mosaic/client'
import { DescribeRobot } from './DescribeRobot'

/** The description of a robot, over its page; the stop stays above it. */
export default function DescribeDialog({ robot, onClose }: { robot: RobotSummary; onClose: () => void }) {
  return (
    <Modal opened onClose={onClose} size="xl" title={`What ${robot.name} has`}>
      <DescribeRobot robot={robot} />
    </Modal>
  )
}
