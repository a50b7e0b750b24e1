import { readFileSync } from 'node:fs'
import type { CatalogueEntry, DescribedConnector } from '@mosaic/protocol'
import { describe, expect, test } from 'vitest'
import { connectorsInTabs, describedCatalogue, driveOf, guessOf, readConnectorConfig, writeConnectorConfig } from '../../src/index'
import { rejectedMids } from '../../src/peers/rejectedMids'

const golden = JSON.parse(
  readFileSync(new URL('../../../../../tests/wire/original_types.json', import.meta.url), 'utf8'),
) as { described: { name: string; connectors: DescribedConnector[]; entries: CatalogueEntry[] }[] }

describe('what people wrote down', () => {
  test.each(golden.described)('becomes the catalogue that Python makes of it: $name', ({ connectors, entries }) => {
    expect(describedCatalogue(connectors)?.entries ?? []).toEqual(entries)
  })

  test('comes back as it was kept, with the keys that we do not know', () => {
    const text = '{"connectors":[{"connectorId":"scan","connectorType":"turtlebot-sender-laser-scan","note":"left","params":{"a":[1]}}]}'
    expect(JSON.parse(writeConnectorConfig(readConnectorConfig(text)) ?? '')).toEqual(JSON.parse(text))
  })

  test.each([null, '', 'null', '[]', '{', '{"connectors":3}', '{"connectors":[3,{"connectorId":""},{"connectorId":"x","dataType":"json-sideways"}]}'])(
    'is nothing where it says %s',
    (text) => expect(readConnectorConfig(text)).toEqual([]),
  )

  test('is forgotten, not kept empty', () => {
    expect(writeConnectorConfig([])).toBeNull()
    expect(describedCatalogue([])).toBeNull()
  })

  test('is driven only where it is known to take velocities', () => {
    const drive = (connector: DescribedConnector) => {
      const entry = describedCatalogue([connector])?.entries[0]
      return entry === undefined ? undefined : driveOf(entry)?.name
    }
    expect(drive({ connectorId: 'd', connectorType: 'turtlebot-receiver-teleop' })).toBe('teleop')
    expect(drive({ connectorId: 'd', connectorType: 'H1DirectionSenderStore' })).toBe('h1-direction')
    expect(drive({ connectorId: 'd', connectorType: 'mine', dataType: 'json-u2r', widget: 'drive-pad' })).toBe('twist')
    expect(drive({ connectorId: 'd', connectorType: 'mine', dataType: 'json-u2r' })).toBeUndefined()
  })
})

describe('the tabs of an original dashboard', () => {
  const tab = (...widgets: unknown[]) => ({ name: 'Default', widgets: JSON.stringify({ widgets }) })
  const at = (robotId: string, ...ids: string[]) => ids.map((connectorId) => ({ robotId, connectorId }))

  test('name connectors of this robot, with the widget that fits', () => {
    const found = connectorsInTabs(
      [
        tab(
          { type: 'LaserScanPolarViewer', connectors: at('r', 'scan') },
          { type: 'ConnectionCheck', connectors: at('r', 'L-receiver', 'L-sender') },
          { type: 'ThumbstickSender', connectors: at('r', 'cmd_vel'), params: { holonomic: true } },
          { type: 'MediaViewer', connectors: at('another', 'front') },
        ),
        tab({ type: 'JsonViewer', connectors: at('r', 'scan') }, { type: 'Unheard', connectors: at('r', 'x') }, null),
      ],
      'r',
    )
    expect(describedCatalogue(found.map(({ connector }) => connector))?.entries.map(({ label, widget }) => [label, widget])).toEqual([
      ['scan', 'laser-scan'],
      ['L', 'connection-check'],
      ['cmd_vel', 'drive-pad'],
    ])
    expect(found[0]?.tab).toBe('Default')
  })

  test.each(['', '{', 'null', '[]', '{"widgets":3}', '{"widgets":[{"type":"JsonViewer","connectors":[null,{"robotId":"r"}]}]}'])(
    'tell nothing where they hold %s',
    (widgets) => expect(connectorsInTabs([{ name: 't', widgets }], 'r')).toEqual([]),
  )
})

describe('what arrives on a label is', () => {
  const bytes = (...texts: string[]) => texts.map((text) => new TextEncoder().encode(text).buffer)

  test.each([
    ['JSON', bytes('{"a":1}', '{"a":2}'), { dataType: 'json-r2u', value: { a: 2 } }],
    ['text', bytes('ready', '{"a":2}'), { dataType: 'string-r2u' }],
    ['bytes', [new Uint8Array([0x0a, 0xff, 0x00]).buffer], { dataType: 'byte-r2u' }],
    ['bytes that happen to be letters with zeros between', [new Uint8Array([65, 0, 66, 0]).buffer], { dataType: 'byte-r2u' }],
    ['not known before anything came', [], null],
  ])('%s', (_what, messages, guess) => expect(guessOf(messages)).toEqual(guess))

  test('a picture, where a track of that name came', () => expect(guessOf([], true)).toEqual({ dataType: 'media' }))
})

test('a line that is rejected is told from one that is merely not used', () => {
  const sdp = [
    'v=0',
    'm=application 9 UDP/DTLS/SCTP webrtc-datachannel',
    'a=mid:0',
    'm=video 0 UDP/TLS/RTP/SAVPF 96',
    'a=mid:1',
    'm=video 9 UDP/TLS/RTP/SAVPF 96',
    'a=inactive',
    'a=mid:2',
    '',
  ].join('\r\n')
  expect(rejectedMids(sdp)).toEqual(['1'])
})
