import { ActionIcon, Menu, Popover } from '@mantine/core'
import type { CatalogueEntry } from '@mosaic/client'
import { IconArrowsTransferDown, IconDots } from '@tabler/icons-react'
import { useState } from 'react'
import { DeliverySheet } from '../delivery/DeliverySheet'
import type { WidgetDefinition } from '../registry/WidgetDefinition'
import type { AnyStore } from '../stores/storeKinds'

export interface CardMenuProps {
  robotId: string
  entry: CatalogueEntry
  store: AnyStore | null
  shown: WidgetDefinition | null
  widgets: readonly WidgetDefinition[]
  onChoose: (widgetId: string) => void
}

/** What can be done with a card: show it another way, see how its data travels. */
export function CardMenu({ robotId, entry, store, shown, widgets, onChoose }: CardMenuProps) {
  const [isDelivery, setDelivery] = useState(false)
  return (
    // The menu's button keeps its own aria-expanded: what the popover is, its dropdown says.
    <Popover opened={isDelivery} onChange={setDelivery} position="bottom-end" width={330} shadow="lg" withinPortal withRoles={false}>
      <Popover.Target>
        <span>
          <Menu position="bottom-end" withinPortal shadow="md">
            <Menu.Target>
              <ActionIcon variant="subtle" color="gray" size="md" aria-label={`Menu of ${entry.label}`}>
                <IconDots size={16} />
              </ActionIcon>
            </Menu.Target>
            <Menu.Dropdown>
              {widgets.length > 1 && <Views {...{ shown, widgets, onChoose }} />}
              <Menu.Item
                leftSection={<IconArrowsTransferDown size={16} stroke={1.6} />}
                disabled={store === null}
                onClick={() => setDelivery(true)}
              >
                Delivery
              </Menu.Item>
            </Menu.Dropdown>
          </Menu>
        </span>
      </Popover.Target>
      <Popover.Dropdown role="dialog" aria-label={`Delivery of ${entry.label}`}>
        {store !== null && <DeliverySheet {...{ robotId, entry, store }} />}
      </Popover.Dropdown>
    </Popover>
  )
}

function Views({ shown, widgets, onChoose }: Pick<CardMenuProps, 'shown' | 'widgets' | 'onChoose'>) {
  return (
    <>
      <Menu.Label>Show as</Menu.Label>
      {widgets.map(({ id, title, icon: Icon }) => (
        <Menu.Item
          key={id}
          leftSection={<Icon size={16} stroke={1.6} />}
          aria-current={id === shown?.id ? 'true' : undefined}
          fw={id === shown?.id ? 600 : 400}
          onClick={() => onChoose(id)}
        >
          {title}
        </Menu.Item>
      ))}
      <Menu.Divider />
    </>
  )
}
