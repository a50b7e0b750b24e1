/**
 * What people wrote down of a robot that announces nothing, as the server keeps it: the `connectorConfig` of original
 * dashboards, JSON in a string. Pure, both ways. `dataType` and `widget` are ours; keys that we don't know stay.
 */
import type { DescribedConnector, MosaicDataType } from '@mosaic/protocol'

/** The eight data types, in the order in which people are offered them. */
export const DATA_TYPES: readonly MosaicDataType[] = [
  'json-r2u',
  'json-u2r',
  'json-bi',
  'string-r2u',
  'string-u2r',
  'byte-r2u',
  'byte-u2r',
  'media',
]

/** Entries that nobody can read are left out, as original dashboards do. */
export function readConnectorConfig(text: string | null | undefined): DescribedConnector[] {
  const rows = recordOf(parsed(text ?? ''))?.connectors
  return Array.isArray(rows) ? rows.filter(isDescribed) : []
}

/** Null where nothing is described. */
export function writeConnectorConfig(connectors: readonly DescribedConnector[]): string | null {
  if (connectors.length === 0) return null
  // Original dashboards read `params` of every entry.
  return JSON.stringify({ connectors: connectors.map((one) => ({ ...one, params: one.params ?? {} })) })
}

function isDescribed(row: unknown): row is DescribedConnector {
  const { connectorId, connectorType = '', params = {}, dataType, widget = '' } = recordOf(row) ?? {}
  const isNamed = typeof connectorId === 'string' && connectorId !== '' && typeof connectorType === 'string'
  const isTyped = dataType === undefined || dataType === null || (DATA_TYPES as readonly unknown[]).includes(dataType)
  return isNamed && isTyped && (params === null || recordOf(params) !== null) && (widget === null || typeof widget === 'string')
}

function parsed(text: string): unknown {
  try {
    return JSON.parse(text)
  } catch {
    return null
  }
}

function recordOf(value: unknown): Record<string, unknown> | null {
  return typeof value === 'object' && value !== null && !Array.isArray(value) ? (value as Record<string, unknown>) : null
}
