import type { ComponentType } from 'react'
import { fetched } from './fetched'
import type { WidgetProps } from './WidgetDefinition'

/** A widget whose code comes when it is first shown. Until then its card is empty, and has its size already. */
export function lazyWidget(load: () => Promise<ComponentType<WidgetProps>>): ComponentType<WidgetProps> {
  return fetched(load, <div aria-busy />)
}
