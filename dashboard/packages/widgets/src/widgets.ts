/**
 * Every widget of the dashboard, each with what it accepts. A new widget is one more entry; nothing else changes.
 *
 * The code of each comes when it is first shown, but that of the picture and the pad, as who is about
 * to drive waits for nothing, and that of the log, of which no line may be missed.
 */
import { messages } from '@mosaic/client'
import {
  IconActivityHeartbeat,
  IconBattery3,
  IconBinary,
  IconBraces,
  IconChartLine,
  IconCompass,
  IconCube,
  IconDeviceGamepad2,
  IconListNumbers,
  IconMapPin,
  IconMessage,
  IconMessageQuestion,
  IconMicrophone,
  IconRadar2,
  IconRoute,
  IconSend,
  IconSteeringWheel,
  IconVideo,
  IconVideoPlus,
  IconVolume,
} from '@tabler/icons-react'
import { DrivePad } from './DrivePad/DrivePad'
import { TextLog } from './TextLog/TextLog'
import { Video } from './Video/Video'
import { lazyWidget } from './registry/lazyWidget'
import type { WidgetDefinition } from './registry/WidgetDefinition'

const FROM_ROBOT = ['json-r2u', 'json-bi'] as const
const TO_ROBOT = ['json-u2r', 'json-bi'] as const

/** The schema ids of these standard messages. */
function standard(...names: readonly (keyof typeof messages.SCHEMA_IDS)[]): readonly string[] {
  return names.map((name) => messages.SCHEMA_IDS[name])
}

/** A third of the page's width, among the others. */
function panel(rows: number): Pick<WidgetDefinition, 'area' | 'size'> {
  return { area: 'panel', size: { columns: 4, rows } }
}

/** All widgets of the dashboard, for `chooseWidget` and `widgetsFor`; put your own beside them: `[...widgets, mine]`. */
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
    Component: lazyWidget(() => import('./Audio/Audio').then((file) => file.Audio)),
  },
  {
    id: 'push-to-talk',
    title: 'Talk',
    icon: IconMicrophone,
    accepts: { dataTypes: ['media'], kinds: ['audio'], directions: ['to-robot'], anything: true, priority: 50 },
    ...panel(2),
    Component: lazyWidget(() => import('./PushToTalk/PushToTalk').then((file) => file.PushToTalk)),
  },
  {
    id: 'drive-pad',
    title: 'Drive pad',
    icon: IconSteeringWheel,
    accepts: {
      dataTypes: TO_ROBOT,
      connectorTypes: ['cmd-vel', 'ros2-receiver-geometry-Twist', 'ros2-receiver-geometry-TwistStamped'],
      fields: [['linear.x', 'angular.z']],
      schemas: standard('Twist'),
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
      schemas: standard('LaserScan'),
      priority: 50,
    },
    ...panel(5),
    Component: lazyWidget(() => import('./LaserScan/LaserScan').then((file) => file.LaserScan)),
  },
  {
    id: 'pose-trail',
    title: 'Pose and way',
    icon: IconRoute,
    accepts: {
      dataTypes: FROM_ROBOT,
      connectorTypes: ['ros2-sender-geometry-Pose', 'ros2-sender-geometry-PoseWithCovarianceStamped'],
      fields: [['position.x', 'position.y', 'orientation'], ['pose.position.x', 'pose.position.y'], ['x', 'y', 'theta']],
      schemas: standard('Pose', 'Odometry'),
      priority: 50,
    },
    ...panel(5),
    Component: lazyWidget(() => import('./PoseTrail/PoseTrail').then((file) => file.PoseTrail)),
  },
  {
    id: 'map',
    title: 'Map',
    icon: IconRoute,
    accepts: { dataTypes: FROM_ROBOT, fields: [['poses'], ['resolution', 'origin.position', 'data']], schemas: standard('Path', 'OccupancyGrid'), priority: 50 },
    ...panel(5),
    Component: lazyWidget(() => import('./Map/MapView').then((file) => file.MapView)),
  },
  {
    id: 'joints',
    title: 'Joints',
    icon: IconListNumbers,
    accepts: { dataTypes: FROM_ROBOT, schemas: standard('JointState'), priority: 50 },
    ...panel(4),
    Component: lazyWidget(() => import('./Joints/Joints').then((file) => file.Joints)),
  },
  {
    id: 'joint-command',
    title: 'Move joints',
    icon: IconSend,
    accepts: { dataTypes: TO_ROBOT, schemas: standard('JointTarget'), priority: 50 },
    ...panel(4),
    Component: lazyWidget(() => import('./JointCommand/JointCommand').then((file) => file.JointCommand)),
  },
  {
    id: 'gripper-command',
    title: 'Gripper',
    icon: IconSend,
    accepts: { dataTypes: TO_ROBOT, schemas: standard('GripperTarget'), priority: 50 },
    ...panel(2),
    Component: lazyWidget(() => import('./JointCommand/GripperCommand').then((file) => file.GripperCommand)),
  },
  {
    id: 'joystick',
    title: 'Stick',
    icon: IconDeviceGamepad2,
    accepts: { dataTypes: FROM_ROBOT, fields: [['axes', 'buttons']], schemas: standard('Joy'), priority: 50 },
    ...panel(4),
    Component: lazyWidget(() => import('./Joystick/Joystick').then((file) => file.Joystick)),
  },
  {
    id: 'diagnostics',
    title: 'Diagnostics',
    icon: IconActivityHeartbeat,
    accepts: { dataTypes: FROM_ROBOT, schemas: standard('Diagnostic'), priority: 50 },
    ...panel(4),
    Component: lazyWidget(() => import('./Diagnostics/Diagnostics').then((file) => file.Diagnostics)),
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
      schemas: standard('GpsFix'),
      priority: 50,
    },
    ...panel(4),
    Component: lazyWidget(() => import('./GpsPosition/GpsPosition').then((file) => file.GpsPosition)),
  },
  {
    id: 'battery',
    title: 'Battery',
    icon: IconBattery3,
    accepts: {
      dataTypes: FROM_ROBOT,
      fields: [['percent', 'voltage_v'], ['percentage', 'voltage'], ['battery_percent']],
      schemas: standard('BatteryState'),
      priority: 50,
    },
    ...panel(2),
    Component: lazyWidget(() => import('./Battery/Battery').then((file) => file.Battery)),
  },
  {
    id: 'imu',
    title: 'IMU',
    icon: IconCompass,
    accepts: {
      dataTypes: FROM_ROBOT,
      connectorTypes: ['h1-imu-state'],
      fields: [['orientation', 'angular_velocity', 'linear_acceleration']],
      schemas: standard('Imu'),
      priority: 60,
    },
    ...panel(3),
    Component: lazyWidget(() => import('./Imu/Imu').then((file) => file.Imu)),
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
    Component: lazyWidget(() => import('./ConnectionCheck/ConnectionCheck').then((file) => file.ConnectionCheck)),
  },
  {
    id: 'recorder',
    title: 'Recorder',
    icon: IconVideoPlus,
    accepts: { dataTypes: ['json-bi'], connectorTypes: ['recorder'], priority: 90 },
    ...panel(3),
    Component: lazyWidget(() => import('./Recorder/Recorder').then((file) => file.Recorder)),
  },
  {
    id: 'request',
    title: 'Ask',
    icon: IconMessageQuestion,
    accepts: { dataTypes: ['json-bi'], priority: 50 },
    ...panel(4),
    Component: lazyWidget(() => import('./RequestPanel/RequestPanel').then((file) => file.RequestPanel)),
  },
  {
    id: 'value-cards',
    title: 'Values',
    icon: IconListNumbers,
    accepts: { dataTypes: FROM_ROBOT, anything: true, schemas: standard('Transform'), priority: 20 },
    ...panel(4),
    Component: lazyWidget(() => import('./ValueCards/ValueCards').then((file) => file.ValueCards)),
  },
  {
    id: 'time-plot',
    title: 'Time plot',
    icon: IconChartLine,
    accepts: {
      dataTypes: FROM_ROBOT,
      anything: true,
      numbers: true,
      schemas: standard('Twist', 'Temperature', 'Range'),
      priority: 10,
    },
    ...panel(4),
    Component: lazyWidget(() => import('./TimePlot/TimePlot').then((file) => file.TimePlot)),
  },
  {
    id: 'raw-json',
    title: 'Raw JSON',
    icon: IconBraces,
    // What is marked is drawn over the picture of its camera; here are the words.
    accepts: { dataTypes: FROM_ROBOT, anything: true, schemas: standard('ImageAnnotations'), priority: 5 },
    ...panel(4),
    Component: lazyWidget(() => import('./RawJson/RawJson').then((file) => file.RawJson)),
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
    id: 'message-log',
    title: 'Log',
    icon: IconMessage,
    accepts: { dataTypes: FROM_ROBOT, schemas: standard('Log'), priority: 50 },
    ...panel(4),
    Component: TextLog,
  },
  {
    id: 'json-sender',
    title: 'Send a message',
    icon: IconSend,
    accepts: { dataTypes: ['json-u2r', 'json-bi', 'string-u2r'], anything: true, bothWays: true, priority: 8 },
    ...panel(4),
    Component: lazyWidget(() => import('./JsonSender/JsonSender').then((file) => file.JsonSender)),
  },
  {
    id: 'point-cloud',
    title: 'Point cloud',
    icon: IconCube,
    accepts: { dataTypes: ['byte-r2u'], connectorTypes: ['point-cloud'], priority: 50 },
    area: 'panel',
    size: { columns: 8, rows: 5 },
    Component: lazyWidget(() => import('./PointCloud/PointCloud').then((file) => file.PointCloud)),
  },
  {
    id: 'bytes',
    title: 'Bytes',
    icon: IconBinary,
    accepts: { dataTypes: ['byte-r2u'], anything: true, priority: 5 },
    ...panel(4),
    Component: lazyWidget(() => import('./ByteView/ByteView').then((file) => file.ByteView)),
  },
]
