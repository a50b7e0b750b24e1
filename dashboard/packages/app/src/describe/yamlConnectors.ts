/**
 * The connectors that a robot's YAML file names, in the original's form or ours. A part of its own, because it brings a
 * YAML reader with it. Nothing but labels, types and numbers of channels is taken: a file also holds tokens and addresses.
 */
import type { DescribedConnector } from '@mosaic/client'
import { isMap, isNode, isScalar, isSeq, LineCounter, parseDocument, type YAMLMap } from 'yaml'
import { suggested } from './description'

export interface YamlProblem {
  /** 1 is the first. */
  line: number
  message: string
}

export interface YamlConnectors {
  connectors: readonly DescribedConnector[]
  problems: readonly YamlProblem[]
}

const PARALLEL_WORDS = ['parallel_num', 'parallel_stream']

export function connectorsInYaml(text: string): YamlConnectors {
  const lines = new LineCounter()
  // A variable of ours in braces would be a mapping to YAML; its value is none of our business.
  const document = parseDocument(text.replace(/\$\{[^}\n]*\}/g, (word) => '_'.repeat(word.length)), { lineCounter: lines, prettyErrors: false })
  const lineAt = (offset: number): number => lines.linePos(offset).line
  if (document.errors.length > 0) {
    return { connectors: [], problems: document.errors.map((error) => ({ line: lineAt(error.pos[0]), message: error.message })) }
  }
  const list = isMap(document.contents) ? document.contents.get('connectors', true) : document.contents
  if (!isSeq(list)) return { connectors: [], problems: [{ line: lineOf(list, lineAt), message: 'there is no list ‘connectors’ in it' }] }
  return readAll(list.items, lineAt)
}

function readAll(items: readonly unknown[], lineAt: (offset: number) => number): YamlConnectors {
  const connectors = new Map<string, DescribedConnector>()
  const problems: YamlProblem[] = []
  for (const item of items) {
    const read = isMap(item) ? connectorOf(item) : 'a connector has a type and a label'
    const label = typeof read === 'string' ? null : read.connectorId
    const problem = typeof read === 'string' ? read : connectors.has(read.connectorId) ? `‘${read.connectorId}’ is there twice; the first one counts` : null
    if (problem !== null) problems.push({ line: lineOf(item, lineAt), message: problem })
    else if (label !== null && typeof read !== 'string') connectors.set(label, read)
  }
  return { connectors: [...connectors.values()], problems }
}

/** A string: what is wrong with it. */
function connectorOf(item: YAMLMap): DescribedConnector | string {
  const [type, label] = [textAt(item, 'type'), textAt(item, 'label')]
  if (type === '' || label === '') return `the connector ${label === '' ? 'has no label' : `‘${label}’ has no type`}`
  const params = item.get('params')
  const word = isMap(params) ? PARALLEL_WORDS.find((one) => params.has(one)) : undefined
  return suggested(label, type, word === undefined || !isMap(params) ? undefined : { [word]: textAt(params, word) })
}

function textAt(map: YAMLMap, key: string): string {
  const node = map.get(key, true)
  if (!isScalar(node) || node.value === null) return ''
  return typeof node.value === 'string' ? node.value.trim() : (node.source ?? '')
}

function lineOf(node: unknown, lineAt: (offset: number) => number): number {
  return isNode(node) && node.range ? lineAt(node.range[0]) : 1
}
