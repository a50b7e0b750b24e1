/** Every widget of the dashboard, each with what it accepts. A new widget is one more entry; nothing else changes. */
import { IconBraces, IconListNumbers, IconSteeringWheel, IconVideo } from '@tabler/icons-react'
import { DrivePad } from '../DrivePad/DrivePad'
import { RawJson } from '../RawJson/RawJson'
import { ValueCards } from '../ValueCards/ValueCards'
import { Video } from '../Video/Video'
import type { WidgetDefinition } from './WidgetDefinition'

const FROM_ROBOT = ['json-r2u', 'json-bi'] as const
const TO_ROBOT = ['json-u2r', 'json-bi'] as const

export const widgets: readonly WidgetDefinition[] = [
  {
    id: 'video',
    title: 'Video',
    icon: IconVideo,
    accepts: { dataTypes: ['media'], kinds: ['video'], anything: true, priority: 50 },
    area: 'picture',
    size: { columns: 8, rows: 7 },
    Component: Video,
  },
  {
    id: 'drive-pad',
    title: 'Drive pad',
    icon: IconSteeringWheel,
    accepts: {
      dataTypes: TO_ROBOT,
      connectorTypes: ['cmd-vel', 'ros2-receiver-geometry-Twist', 'ros2-receiver-geometry-TwistStamped'],
      fields: [['linear.x', 'angular.z']],
      priority: 50,
    },
    area: 'control',
    size: { columns: 4, rows: 7 },
    Component: DrivePad,
  },
  {
    id: 'value-cards',
    title: 'Values',
    icon: IconListNumbers,
    accepts: { dataTypes: FROM_ROBOT, anything: true, priority: 20 },
    area: 'panel',
    size: { columns: 4, rows: 3 },
    Component: ValueCards,
  },
  {
    id: 'raw-json',
    title: 'Raw JSON',
    icon: IconBraces,
    accepts: { dataTypes: FROM_ROBOT, anything: true, priority: 5 },
    area: 'panel',
    size: { columns: 4, rows: 4 },
    Component: RawJson,
  },
]
