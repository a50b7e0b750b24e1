/** Whether the server has the very module that a robot announces. Nothing else is ever loaded into a page. */
import type { WidgetModule, WidgetOffer } from '@mosaic/client'

export type Served = { url: string } | { why: string }

export function servedModule(wanted: WidgetModule, offer: WidgetOffer): Served {
  if (!offer.isOn) return { why: 'Widgets of plugins are switched off on this server.' }
  if (offer.modules.some(({ sha256 }) => sha256 === wanted.sha256)) return { url: `/widgets/${wanted.sha256}.js` }
  const other = offer.modules.find(({ name }) => name === wanted.name)
  // No command to copy: the name is the robot's word, and installing it is trusting it.
  if (other === undefined) return { why: 'The server does not have this plugin. Whoever runs the server may install it there, and start it anew.' }
  return { why: `${differenceOf(wanted, other)} Install the same on both, and start them anew.` }
}

/** The distribution and its version, as people name it. */
export function sourceOf({ distribution, version }: WidgetModule): string {
  return `${distribution} ${version}`.trim()
}

function differenceOf(wanted: WidgetModule, other: WidgetModule): string {
  if (sourceOf(wanted) !== sourceOf(other)) return `The robot has ${sourceOf(wanted)}, the server has ${sourceOf(other)}.`
  return `${sourceOf(wanted)} of the robot and of the server are not the same: one was built or changed by itself.`
}
