import { messages, WIDGET_HINTS, type CatalogueEntry, type MosaicDataType } from '@mosaic/client'
import { describe, expect, test } from 'vitest'
import { chooseWidget, fitOf, widgetsFor } from './chooseWidget'
import { widgets } from '../widgets'

function entry(fields: Partial<CatalogueEntry>): CatalogueEntry {
  return {
    label: 'thing',
    type: 'something',
    kind: 'data',
    dataType: 'json-r2u',
    direction: 'to-operator',
    channels: [],
    delivery: 'reliable',
    ...fields,
  }
}

const chosen = (fields: Partial<CatalogueEntry>, choice?: string) => chooseWidget(widgets, entry(fields), choice)?.id

const object = (...names: string[]) => ({
  type: 'object',
  properties: Object.fromEntries(names.map((name) => [name, { type: 'number' }])),
})

describe('a connector is shown by', () => {
  test.each([
    'drive-pad',
    'video',
    'laser-scan',
    'pose-trail',
    'battery',
    'imu',
    'gps',
    'time-plot',
    'value-cards',
    'raw-json',
    'connection-check',
  ])('the widget that the robot names: %s', (widget) => {
    const definition = widgets.find(({ id }) => id === widget)
    const dataType = definition?.accepts.dataTypes[0] ?? 'json-r2u'
    const kind = definition?.accepts.kinds?.[0] ?? 'data'
    expect(chosen({ widget, dataType, kind })).toBe(widget)
  })

  test('another spelling of the hint', () => expect(chosen({ widget: 'gps-position' })).toBe('gps'))

  test('its type, where a robot names nothing', () => {
    expect(chosen({ type: 'cmd-vel', dataType: 'json-u2r' })).toBe('drive-pad')
    expect(chosen({ type: 'ros2-sender-sensor-NavSatFix' })).toBe('gps')
    expect(chosen({ type: 'connection-check', dataType: 'json-bi' })).toBe('connection-check')
  })

  test('the standard message that it sends or takes', () => {
    expect(chosen({ schemaId: 'mosaic/BatteryState@1' })).toBe('battery')
    expect(chosen({ schemaId: 'mosaic/Twist@1', dataType: 'json-u2r' })).toBe('drive-pad')
    expect(chosen({ schemaId: 'mosaic/Twist@1' })).toBe('time-plot')
    expect(chosen({ schemaId: 'mosaic/Path@1' })).toBe('map')
    expect(chosen({ schemaId: 'mosaic/OccupancyGrid@1' })).toBe('map')
    expect(chosen({ schemaId: 'mosaic/JointState@1' })).toBe('joints')
    expect(chosen({ schemaId: 'mosaic/JointTarget@1', dataType: 'json-u2r' })).toBe('joint-command')
    expect(chosen({ schemaId: 'mosaic/Joy@1' })).toBe('joystick')
    expect(chosen({ schemaId: 'mosaic/GripperTarget@1', dataType: 'json-u2r' })).toBe('gripper-command')
    expect(chosen({ schemaId: 'mosaic/Diagnostic@1' })).toBe('diagnostics')
    expect(chosen({ schemaId: 'mosaic/BatteryState@2', messageSchema: object('x') })).toBe('value-cards')
  })

  test('the widget that the robot names, whatever message it sends', () => {
    expect(chosen({ schemaId: 'mosaic/BatteryState@1', widget: 'raw-json' })).toBe('raw-json')
  })

  test('its schema', () => {
    expect(chosen({ messageSchema: object('ranges', 'angle_min', 'angle_increment') })).toBe('laser-scan')
    expect(chosen({ messageSchema: object('latitude', 'longitude') })).toBe('gps')
    expect(chosen({ messageSchema: object('percent', 'voltage_v') })).toBe('battery')
  })

  test('something general, where nothing fits better', () => {
    expect(chosen({})).toBe('value-cards')
    expect(chosen({ dataType: 'string-r2u' })).toBe('text-log')
    expect(chosen({ dataType: 'json-u2r', messageSchema: object('gripper') })).toBe('json-sender')
    expect(chosen({ dataType: 'byte-r2u' })).toBe('bytes')
  })

  test('what a person chose, if that can show it', () => {
    expect(chosen({ widget: 'battery' }, 'raw-json')).toBe('raw-json')
    expect(chosen({ widget: 'battery' }, 'video')).toBe('battery')
  })

  test('its direction, where that is all that differs', () => {
    expect(chosen({ dataType: 'media', kind: 'audio', direction: 'to-operator' })).toBe('audio')
    expect(chosen({ dataType: 'media', kind: 'audio', direction: 'to-robot' })).toBe('push-to-talk')
  })

  test('nothing, and that is said, where nothing fits', () => {
    expect(chosen({ dataType: 'byte-u2r' })).toBeUndefined()
    expect(chosen({ dataType: 'media', kind: 'audio', direction: 'both' })).toBeUndefined()
  })
})

test('every handler of a connector has a card, with the widget that fits it best', () => {
  const shown = [
    entry({ label: 'arm', dataType: 'json-u2r', schemaId: 'mosaic/JointTarget@1' }),
    entry({ label: 'arm_base', dataType: 'json-u2r', schemaId: 'mosaic/Twist@1' }),
    entry({ label: 'arm_state', dataType: 'json-r2u', direction: 'to-operator', schemaId: 'mosaic/JointState@1' }),
    entry({ label: 'arm_load', dataType: 'json-r2u', direction: 'to-operator', widget: 'time-plot', messageSchema: object('newton') }),
    entry({ label: 'arm_talk', dataType: 'json-bi', direction: 'both', messageSchema: object('grip'), sentSchema: object('force') }),
    entry({ label: 'arm_power', dataType: 'json-bi', direction: 'both', sentSchemaId: 'mosaic/BatteryState@1' }),
    entry({ label: 'arm_left', dataType: 'media', kind: 'video' }),
    entry({ label: 'arm_ear', dataType: 'media', kind: 'audio', direction: 'to-operator' }),
  ]
  expect(shown.map((one) => [one.label, chooseWidget(widgets, one)?.id])).toEqual([
    ['arm', 'joint-command'],
    ['arm_base', 'drive-pad'],
    ['arm_state', 'joints'],
    ['arm_load', 'time-plot'],
    ['arm_talk', 'json-sender'],
    ['arm_power', 'battery'],
    ['arm_left', 'video'],
    ['arm_ear', 'audio'],
  ])
})

test('what goes both ways is a form where only what operators send is known, and values where only the rest is', () => {
  const both = { dataType: 'json-bi', direction: 'both' } as const
  expect(chosen({ ...both, messageSchema: object('grip'), sentSchema: object('force') })).toBe('json-sender')
  const standard = { schemaId: 'mosaic/GripperTarget@1', sentSchemaId: 'mosaic/JointState@1' }
  expect(chosen({ ...both, ...standard, messageSchema: object('position'), sentSchema: object('names') })).toBe('json-sender')
  expect(chosen({ ...both, sentSchema: object('percent', 'voltage_v') })).toBe('battery')
  expect(chosen({ ...both, messageSchema: object('percent', 'voltage_v') })).not.toBe('battery')
})

test('a hint never forces a widget on data that it can not show', () => {
  expect(chosen({ widget: 'video', dataType: 'json-r2u' })).toBe('value-cards')
})

describe('a plot', () => {
  const words = { type: 'object', properties: { level: { type: 'string' }, timestamp: { type: 'integer' } } }
  const poses = { type: 'object', properties: { poses: { type: 'array', items: { type: 'object' } } } }
  const offered = (fields: Partial<CatalogueEntry>) => widgetsFor(widgets, entry(fields)).map(({ id }) => id)

  test.each([words, poses])('is not offered for messages without a number', (messageSchema) => {
    expect(offered({ messageSchema })).not.toContain('time-plot')
  })

  test.each([
    undefined,
    { type: 'object', additionalProperties: true },
    object('newton'),
    { type: 'object', properties: { effort: { type: 'array', items: { type: 'number' } } } },
  ])('is offered where there may be one', (messageSchema) => {
    expect(offered(messageSchema === undefined ? {} : { messageSchema })).toContain('time-plot')
  })

  test('gives way to the widget that the message has, whoever hints or chose it', () => {
    const diagnostic = { schemaId: 'mosaic/Diagnostic@1', messageSchema: words, widget: 'time-plot' }
    expect(chosen(diagnostic)).toBe('diagnostics')
    expect(chosen(diagnostic, 'time-plot')).toBe('diagnostics')
    expect(chosen({ schemaId: 'mosaic/Log@1', messageSchema: words }, 'time-plot')).toBe('message-log')
    expect(chosen({ schemaId: 'mosaic/Path@1', messageSchema: poses }, 'time-plot')).toBe('map')
  })
})

test('without a schema special widgets are offered, but not chosen', () => {
  const offered = widgetsFor(widgets, entry({})).map(({ id }) => id)
  expect(offered).toContain('laser-scan')
  expect(offered.indexOf('value-cards')).toBeLessThan(offered.indexOf('laser-scan'))
})

test('with a schema that does not fit they are not even offered', () => {
  const scan = widgets.find(({ id }) => id === 'laser-scan')
  expect(scan && fitOf(scan, entry({ messageSchema: object('percent') }))).toBeNull()
})

test('a handler may name every widget, and no other', () => {
  const hints = widgets.flatMap(({ id, accepts }) => [id, ...(accepts.hints ?? [])])
  expect(new Set(hints)).toEqual(new Set<string>(WIDGET_HINTS))
})

test('every id is unique', () => {
  expect(new Set(widgets.map(({ id }) => id)).size).toBe(widgets.length)
})

const dataTypes: readonly MosaicDataType[] = ['json-r2u', 'json-u2r']

test.each(Object.values(messages.SCHEMA_IDS))('%s has a widget that was made for it', (schemaId) => {
  const fits = widgets.flatMap((widget) => dataTypes.map((dataType) => fitOf(widget, entry({ schemaId, dataType }))))
  expect(fits).toContain('message')
})
