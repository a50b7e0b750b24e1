/** What the robot of a page announces: entries, and the hash by which a page knows that they are the same. */
import { messages, type Catalogue, type CatalogueEntry, type Delivery } from '@mosaic/protocol'

type StandardMessage = keyof typeof messages.SCHEMA_IDS

/** An entry for what is told in standard messages. */
export function dataEntry(label: string, message: StandardMessage, delivery: Delivery): CatalogueEntry {
  const schemaId = messages.SCHEMA_IDS[message]
  return { label, type: `browser-${label}`, kind: 'data', dataType: 'json-r2u', direction: 'to-operator', channels: [{ label, dataType: 'json-r2u' }], delivery, schemaId }
}

/** An entry for a camera, a microphone or a loudspeaker. */
export function mediaEntry(label: string, kind: 'video' | 'audio', direction: CatalogueEntry['direction'] = 'to-operator'): CatalogueEntry {
  return { label, type: `browser-${label}`, kind, dataType: 'media', direction, channels: [], delivery: 'reliable' }
}

export function catalogueOf(entries: readonly CatalogueEntry[]): Catalogue {
  return { hash: hashOf(JSON.stringify(entries)), entries }
}

const FNV_PRIME = 0x1_00_00_00_01_b3n
const FNV_OFFSET = 0xcb_f2_9c_e4_84_22_23_25n

/** FNV-1a, 64 bits: it tells two catalogues of one robot apart and protects nothing, and is there without https. */
function hashOf(text: string): string {
  let hash = FNV_OFFSET
  for (const byte of new TextEncoder().encode(text)) hash = ((hash ^ BigInt(byte)) * FNV_PRIME) & 0xffff_ffff_ffff_ffffn
  return hash.toString(16).padStart(16, '0')
}
