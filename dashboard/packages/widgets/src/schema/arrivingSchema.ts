import type { CatalogueEntry } from '@mosaic/client'
import type { JsonSchema } from './jsonSchema'

type Described = Pick<CatalogueEntry, 'dataType' | 'messageSchema' | 'sentSchema'>

/** The schema of what the robot sends; undefined where it sends nothing or says nothing of it. */
export function arrivingSchema({ dataType, messageSchema, sentSchema }: Described): JsonSchema | undefined {
  return dataType === 'json-bi' ? sentSchema : messageSchema
}
