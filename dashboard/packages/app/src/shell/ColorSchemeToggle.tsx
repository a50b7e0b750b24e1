import { ActionIcon, Tooltip, useMantineColorScheme, type MantineColorScheme } from '@mantine/core'
import { IconDeviceDesktop, IconMoon, IconSun } from '@tabler/icons-react'

const SCHEMES: Record<MantineColorScheme, { Icon: typeof IconSun; next: MantineColorScheme; name: string }> = {
  auto: { Icon: IconDeviceDesktop, next: 'light', name: 'the system’s colours' },
  light: { Icon: IconSun, next: 'dark', name: 'light colours' },
  dark: { Icon: IconMoon, next: 'auto', name: 'dark colours' },
}

/** Light, dark, or what the system says. */
export function ColorSchemeToggle() {
  const { colorScheme, setColorScheme } = useMantineColorScheme()
  const { Icon, next, name } = SCHEMES[colorScheme]
  const label = `Now ${name}; switch to ${SCHEMES[next].name}`
  return (
    <Tooltip label={label} openDelay={400}>
      <ActionIcon variant="subtle" color="gray" size={36} aria-label={label} onClick={() => setColorScheme(next)}>
        <Icon size={18} stroke={1.6} />
      </ActionIcon>
    </Tooltip>
  )
}
