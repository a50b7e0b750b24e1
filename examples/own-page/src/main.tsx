import '@mantine/core/styles.css'
import '@mosaic/widgets/style.css'
import { MantineProvider } from '@mantine/core'
import { MosaicClient } from '@mosaic/client'
import { MosaicProvider, useReadable, useRobotConnection, useRobots } from '@mosaic/react'
import { chooseWidget, cssVariables, theme, WidgetCard, widgets } from '@mosaic/widgets'
import { useEffect } from 'react'
import { createRoot } from 'react-dom/client'

const LABELS = ['front', 'battery']
const client = new MosaicClient()

function Robot({ robotId }: { robotId: string }) {
  const connection = useRobotConnection(robotId)
  const catalogue = useReadable(connection.catalogue)
  useEffect(() => {
    connection.connect()
    return () => connection.disconnect()
  }, [connection])
  const shown = catalogue?.entries.filter(({ label }) => LABELS.includes(label))
  return shown?.map((entry) => (
    <div key={entry.label} style={{ height: 360 }}>
      <WidgetCard {...{ robotId, entry }} widget={chooseWidget(widgets, entry)} alternatives={[]} onChoose={() => {}} />
    </div>
  ))
}

function Page() {
  const robot = useRobots().find(({ isOnline }) => isOnline)
  if (useReadable(client.session) !== null) return robot ? <Robot robotId={robot.id} /> : 'No robot is online.'
  return (
    <form action={(form) => client.login(String(form.get('email')), String(form.get('password')))}>
      <input name="email" type="email" placeholder="Email" required />
      <input name="password" type="password" placeholder="Password" required />
      <button>Sign in</button>
    </form>
  )
}

createRoot(document.getElementById('root')!).render(
  <MosaicProvider client={client}>
    <MantineProvider theme={theme} cssVariablesResolver={cssVariables} defaultColorScheme="auto">
      <Page />
    </MantineProvider>
  </MosaicProvider>,
)
