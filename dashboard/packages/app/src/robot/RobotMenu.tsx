import { ActionIcon, Menu } from '@mantine/core'
import type { RobotSummary } from '@mosaic/client'
import { useControl, useMosaicClient, useReadable } from '@mosaic/react'
import { IconDotsVertical, IconListDetails, IconUserShield } from '@tabler/icons-react'
import { lazy, Suspense, useState } from 'react'

const JournalDrawer = lazy(() => import('../journal/JournalDrawer'))
const GrantsDialog = lazy(() => import('../grants/GrantsDialog'))

/** What only some may see of a robot: the journal for supervisors, who may do what for administrators. */
export function RobotMenu({ robotId, robot }: { robotId: string; robot: RobotSummary | undefined }) {
  const [open, setOpen] = useState<'journal' | 'grants' | null>(null)
  const { me } = useControl(robotId)
  const session = useReadable(useMosaicClient().session)
  const seesJournal = me?.role === 'supervisor'
  const isAdmin = session?.user.isOrganizationAdmin === true
  if (!seesJournal && !isAdmin) return null
  const close = () => setOpen(null)
  return (
    <>
      <Menu position="bottom-end" shadow="md" withinPortal>
        <Menu.Target>
          <ActionIcon variant="subtle" color="gray" size={36} aria-label="More about this robot">
            <IconDotsVertical size={18} stroke={1.6} />
          </ActionIcon>
        </Menu.Target>
        <Menu.Dropdown>
          {seesJournal && (
            <Menu.Item leftSection={<IconListDetails size={16} stroke={1.6} />} onClick={() => setOpen('journal')}>
              Journal: who did what
            </Menu.Item>
          )}
          {isAdmin && (
            <Menu.Item leftSection={<IconUserShield size={16} stroke={1.6} />} onClick={() => setOpen('grants')}>
              Roles: who may do what
            </Menu.Item>
          )}
        </Menu.Dropdown>
      </Menu>
      <Suspense>
        {open === 'journal' && <JournalDrawer robotId={robotId} name={robot?.name ?? 'robot'} onClose={close} />}
        {open === 'grants' && <GrantsDialog robotId={robotId} name={robot?.name ?? 'robot'} onClose={close} />}
      </Suspense>
    </>
  )
}
