import { describe, expect, test } from 'vitest'
import { connectorsInYaml } from './yamlConnectors'

const read = (text: string) => connectorsInYaml(text)
const lineOne = (text: string) => read(text).problems[0]

describe('of a robot’s file are taken', () => {
  test('labels and types of the original’s connectors, and nothing that could be a secret', () => {
    const { connectors, problems } = read(`
server:
  ws_url: wss://mosaic.example.org
  auth: { type: simple-token, robot_id: x, params: { token: secret } }
connectors:
  - type: ros2-receiver-geometry-Twist
    label: cmd_vel
    params: { topic_name: /cmd_vel, password: secret }
  - { type: ros2-sender-sensor-PointCloud2, label: cloud, params: { parallel_num: "3", voxel_size: 0.5 } }
  - { type: ros2-sender-sensor-PointCloud2, label: old, params: { parallel_stream: 2 } }
`)
    expect(problems).toEqual([])
    expect(connectors).toEqual([
      { connectorId: 'cmd_vel', connectorType: 'ros2-receiver-geometry-Twist' },
      { connectorId: 'cloud', connectorType: 'ros2-sender-sensor-PointCloud2', params: { parallel_num: '3' } },
      { connectorId: 'old', connectorType: 'ros2-sender-sensor-PointCloud2', params: { parallel_stream: '2' } },
    ])
    expect(JSON.stringify(connectors)).not.toContain('secret')
  })

  test('those of a file of ours, with its variables', () => {
    const { connectors, problems } = read(`version: 1
server: { ws_url: wss://x, auth: { type: simple-token, robot_id: x, params: { token: \${MOSAIC_TOKEN} } } }
connectors:
  - { type: camera, label: front, params: { source: \${CAMERA} } }
  - { type: cmd-vel, label: cmd_vel, safety: { timeout_s: 0.3 }, delivery: latest }
  - { type: battery, label: 7 }
`)
    expect(problems).toEqual([])
    expect(connectors).toEqual([
      { connectorId: 'front', connectorType: 'camera', dataType: 'media' },
      { connectorId: 'cmd_vel', connectorType: 'cmd-vel', dataType: 'json-u2r', widget: 'drive-pad' },
      { connectorId: '7', connectorType: 'battery', dataType: 'json-r2u' },
    ])
  })

  test('unknown types by their words: upstream’s names say who sends', () => {
    const { connectors } = read(`connectors:
  - { type: acme-sender-engine, label: a }
  - { type: acme-receiver-arm, label: b }
  - { type: acme-thermal-camera, label: c }
`)
    expect(connectors.map(({ dataType }) => dataType)).toEqual(['json-r2u', 'json-u2r', 'media'])
  })

  test('a bare list of connectors', () => {
    expect(read('- { type: h1-camera, label: eye }').connectors).toHaveLength(1)
  })
})

describe('what is wrong is told with its line', () => {
  test.each([
    ['a tab where YAML forbids it', 'connectors:\n  - type: x\n\tlabel: y\n', 3],
    ['no connectors', 'server:\n  ws_url: x\n', 1],
    ['connectors that are no list', 'server: {}\nconnectors: 3\n', 2],
    ['a connector without a label', 'connectors:\n  - { type: a, label: x }\n  - { type: b }\n', 3],
    ['a connector without a type', 'connectors:\n  - { label: x }\n', 2],
    ['a connector that is a word', 'connectors:\n  - camera\n', 2],
    ['a label that is there twice', 'connectors:\n  - { type: a, label: x }\n  - { type: b, label: x }\n', 3],
    ['nothing at all', '', 1],
  ])('%s', (_what, text, line) => expect(lineOne(text)?.line).toBe(line))

  test('and takes nothing from the rest', () => {
    const { connectors, problems } = read('connectors:\n  - { type: a }\n  - { type: b, label: x }\n')
    expect([connectors.length, problems.length]).toEqual([1, 1])
    expect(problems[0]?.message).toBe('the connector has no label')
  })
})
