import { useMemo, useState } from 'react'
import type { Field, JsonSchema } from '../schema/jsonSchema'
import { numericFields } from '../schema/messageFields'
import { keyOf } from './limits'

/** More lines than this no legend holds. */
const MAX_FIELDS = 96
const NONE: readonly Field[] = []

/** The numbers that there are in the messages of a schema, and what to call with each message: messages tell what there
 *  is without a schema, and which of the fields that may be left out are not. It is true where a field is new. A schema
 *  may come after the first messages, and begins anew: it knows the units. */
export function useNumericFields(schema: JsonSchema | undefined): [readonly Field[], (message: unknown) => boolean] {
  const key = useMemo(() => (schema === undefined ? '' : JSON.stringify(schema)), [schema])
  // The same words in another object are the same schema.
  const { declared, known } = useMemo(() => {
    const known: JsonSchema | undefined = key === '' ? undefined : (JSON.parse(key) as JsonSchema)
    return { declared: numericFields(known, undefined), known }
  }, [key])
  const [found, setFound] = useState({ key, fields: NONE })
  const fields = found.key === key && found.fields.length > 0 ? found.fields : declared
  const learn = (message: unknown) => {
    const there = allOf(fields, numericFields(known, message))
    if (there.length === fields.length) return false
    setFound({ key, fields: there })
    return true
  }
  return [fields, learn]
}

/** Fields that come and go keep their lines. */
function allOf(known: readonly Field[], there: readonly Field[]): readonly Field[] {
  const keys = new Set(known.map(keyOf))
  return [...known, ...there.filter((field) => !keys.has(keyOf(field)))].slice(0, MAX_FIELDS)
}
