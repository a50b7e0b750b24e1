import { ActionIcon, Menu } from '@mantine/core'
import type { RobotSummary } from '@mosaic/client'
import { useControl, useMosaicClient, useReadable } from '@mosaic/react'
import { lazyDialog } from '@mosaic/widgets'
import { IconDotsVertical, IconKey, IconListDetails, IconUserShield } from '@tabler/icons-react'
import { useState } from 'react'

/** The other robots sign in without one. */
const SIMPLE_TOKEN = 1
const JournalDrawer = lazyDialog(() => import('../journal/JournalDrawer'))
const NewTokenDialog = lazyDialog(() => import('../robots/NewTokenDialog'))
const GrantsDialog = lazyDialog(() => import('../grants/GrantsDialog'))

/** What only some may see of a robot: the journal for supervisors, roles and its token for administrators. */
export function RobotMenu({ robotId, robot }: { robotId: string; robot: RobotSummary | undefined }) {
  const [open, setOpen] = useState<'journal' | 'grants' | 'token' | null>(null)
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
          {isAdmin && robot?.authType === SIMPLE_TOKEN && (
            <Menu.Item leftSection={<IconKey size={16} stroke={1.6} />} onClick={() => setOpen('token')}>
              New token
            </Menu.Item>
          )}
        </Menu.Dropdown>
      </Menu>
      {open === 'journal' && <JournalDrawer robotId={robotId} name={robot?.name ?? 'robot'} onClose={close} />}
      {open === 'token' && <NewTokenDialog robotId={robotId} name={robot?.name ?? 'robot'} onClose={close} />}
      {open === 'grants' && <GrantsDialog robotId={robotId} name={robot?.name ?? 'robot'} onClose={close} />}
    </>
  )
}
