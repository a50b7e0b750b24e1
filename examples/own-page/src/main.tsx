import '@mantine/core/styles.css'
import '@mosaic/widgets/style.css'
import { MosaicClient } from '@mosaic/client'
import { ConnectorCard, MosaicPage, RobotChoice } from '@mosaic/widgets'
import { createRoot } from 'react-dom/client'

const client = new MosaicClient()

function Robot({ robotId }: { robotId: string }) {
  return (
    <>
      <ConnectorCard robotId={robotId} label="front" />
      <ConnectorCard robotId={robotId} label="battery" />
    </>
  )
}

createRoot(document.getElementById('root')!).render(
  <MosaicPage client={client}>
    <RobotChoice>{(robotId) => <Robot robotId={robotId} />}</RobotChoice>
  </MosaicPage>,
)
