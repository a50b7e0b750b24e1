/** Every widget of the dashboard, each with what it accepts. A new widget is one more entry; nothing else changes. */
import {
  IconActivityHeartbeat,
  IconBattery3,
  IconBinary,
  IconBraces,
  IconChartLine,
  IconCompass,
  IconCube,
  IconListNumbers,
  IconMapPin,
  IconMessage,
  IconMicrophone,
  IconRadar2,
  IconRoute,
  IconSend,
  IconSteeringWheel,
  IconVideo,
  IconVideoPlus,
  IconVolume,
} from '@tabler/icons-react'
import { Audio } from './Audio/Audio'
import { Battery } from './Battery/Battery'
import { ByteView } from './ByteView/ByteView'
import { ConnectionCheck } from './ConnectionCheck/ConnectionCheck'
import { DrivePad } from './DrivePad/DrivePad'
import { GpsPosition } from './GpsPosition/GpsPosition'
import { Imu } from './Imu/Imu'
import { JsonSender } from './JsonSender/JsonSender'
import { LaserScan } from './LaserScan/LaserScan'
import { PointCloud } from './PointCloud/PointCloud'
import { PoseTrail } from './PoseTrail/PoseTrail'
import { PushToTalk } from './PushToTalk/PushToTalk'
import { RawJson } from './RawJson/RawJson'
import { Recorder } from './Recorder/Recorder'
import { TextLog } from './TextLog/TextLog'
import { TimePlot } from './TimePlot/TimePlot'
import { ValueCards } from './ValueCards/ValueCards'
import { Video } from './Video/Video'
import type { WidgetDefinition } from './registry/WidgetDefinition'

const FROM_ROBOT = ['json-r2u', 'json-bi'] as const
const TO_ROBOT = ['json-u2r', 'json-bi'] as const

/** A third of the page's width, among the others. */
function panel(rows: number): Pick<WidgetDefinition, 'area' | 'size'> {
  return { area: 'panel', size: { columns: 4, rows } }
}

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
    id: 'audio',
    title: 'Sound',
    icon: IconVolume,
    accepts: { dataTypes: ['media'], kinds: ['audio'], directions: ['to-operator'], anything: true, priority: 50 },
    ...panel(2),
    Component: Audio,
  },
  {
    id: 'push-to-talk',
    title: 'Talk',
    icon: IconMicrophone,
    accepts: { dataTypes: ['media'], kinds: ['audio'], directions: ['to-robot'], anything: true, priority: 50 },
    ...panel(2),
    Component: PushToTalk,
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
    id: 'laser-scan',
    title: 'Laser scan',
    icon: IconRadar2,
    accepts: {
      dataTypes: [...FROM_ROBOT, 'byte-r2u'],
      connectorTypes: ['turtlebot-sender-laser-scan', 'laser-scan'],
      fields: [['ranges', 'angle_min', 'angle_increment']],
      priority: 50,
    },
    ...panel(5),
    Component: LaserScan,
  },
  {
    id: 'pose-trail',
    title: 'Pose and way',
    icon: IconRoute,
    accepts: {
      dataTypes: FROM_ROBOT,
      connectorTypes: ['ros2-sender-geometry-Pose', 'ros2-sender-geometry-PoseWithCovarianceStamped'],
      fields: [['position.x', 'position.y', 'orientation'], ['pose.position.x', 'pose.position.y'], ['x', 'y', 'theta']],
      priority: 50,
    },
    ...panel(5),
    Component: PoseTrail,
  },
  {
    id: 'gps',
    title: 'GPS position',
    icon: IconMapPin,
    accepts: {
      dataTypes: FROM_ROBOT,
      hints: ['gps-position'],
      connectorTypes: ['ros2-sender-sensor-NavSatFix'],
      fields: [['latitude', 'longitude'], ['lat', 'lng'], ['lat', 'lon']],
      priority: 50,
    },
    ...panel(4),
    Component: GpsPosition,
  },
  {
    id: 'battery',
    title: 'Battery',
    icon: IconBattery3,
    accepts: {
      dataTypes: FROM_ROBOT,
      fields: [['percent', 'voltage_v'], ['percentage', 'voltage'], ['battery_percent']],
      priority: 50,
    },
    ...panel(2),
    Component: Battery,
  },
  {
    id: 'imu',
    title: 'IMU',
    icon: IconCompass,
    accepts: {
      dataTypes: FROM_ROBOT,
      connectorTypes: ['h1-imu-state'],
      fields: [['orientation', 'angular_velocity', 'linear_acceleration']],
      priority: 60,
    },
    ...panel(3),
    Component: Imu,
  },
  {
    id: 'connection-check',
    title: 'Connection check',
    icon: IconActivityHeartbeat,
    accepts: {
      dataTypes: ['json-bi', 'json-r2u', 'json-u2r', 'string-r2u', 'string-u2r'],
      connectorTypes: ['connection-check'],
      priority: 90,
    },
    ...panel(4),
    Component: ConnectionCheck,
  },
  {
    id: 'recorder',
    title: 'Recorder',
    icon: IconVideoPlus,
    accepts: { dataTypes: ['json-bi'], connectorTypes: ['recorder'], priority: 90 },
    ...panel(3),
    Component: Recorder,
  },
  {
    id: 'value-cards',
    title: 'Values',
    icon: IconListNumbers,
    accepts: { dataTypes: FROM_ROBOT, anything: true, priority: 20 },
    ...panel(4),
    Component: ValueCards,
  },
  {
    id: 'time-plot',
    title: 'Time plot',
    icon: IconChartLine,
    accepts: { dataTypes: FROM_ROBOT, anything: true, priority: 10 },
    ...panel(4),
    Component: TimePlot,
  },
  {
    id: 'raw-json',
    title: 'Raw JSON',
    icon: IconBraces,
    accepts: { dataTypes: FROM_ROBOT, anything: true, priority: 5 },
    ...panel(4),
    Component: RawJson,
  },
  {
    id: 'text-log',
    title: 'Log',
    icon: IconMessage,
    accepts: { dataTypes: ['string-r2u'], anything: true, priority: 20 },
    ...panel(4),
    Component: TextLog,
  },
  {
    id: 'json-sender',
    title: 'Send a message',
    icon: IconSend,
    accepts: { dataTypes: ['json-u2r', 'json-bi', 'string-u2r'], anything: true, priority: 8 },
    ...panel(4),
    Component: JsonSender,
  },
  {
    id: 'point-cloud',
    title: 'Point cloud',
    icon: IconCube,
    accepts: { dataTypes: ['byte-r2u'], connectorTypes: ['point-cloud'], priority: 50 },
    area: 'panel',
    size: { columns: 8, rows: 5 },
    Component: PointCloud,
  },
  {
    id: 'bytes',
    title: 'Bytes',
    icon: IconBinary,
    accepts: { dataTypes: ['byte-r2u'], anything: true, priority: 5 },
    ...panel(4),
    Component: ByteView,
  },
]
