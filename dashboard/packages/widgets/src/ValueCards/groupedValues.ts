/** Values under the heading of the object they belong to. */
import type { FieldValue } from '../schema/messageFields'

export interface ValueGroup {
  heading: string
  values: FieldValue[]
}

export function groupedValues(values: readonly FieldValue[]): ValueGroup[] {
  const groups = new Map<string, FieldValue[]>()
  for (const value of values) {
    const heading = value.path.slice(0, -1).join(' · ').replaceAll('_', ' ')
    groups.set(heading, [...(groups.get(heading) ?? []), value])
  }
  return [...groups].map(([heading, grouped]) => ({ heading, values: grouped }))
}
