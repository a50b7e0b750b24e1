/** Fields under the heading of the object they belong to. */
import type { Field } from './jsonSchema'

export interface FieldGroup<F extends Field> {
  heading: string
  fields: F[]
}

export function groupedFields<F extends Field>(fields: readonly F[]): FieldGroup<F>[] {
  const groups = new Map<string, F[]>()
  for (const field of fields) {
    const heading = field.path.slice(0, -1).join(' · ').replaceAll('_', ' ')
    groups.set(heading, [...(groups.get(heading) ?? []), field])
  }
  return [...groups].map(([heading, grouped]) => ({ heading, fields: grouped }))
}
