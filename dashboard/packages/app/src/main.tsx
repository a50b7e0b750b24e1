import '@fontsource-variable/inter/wght.css'
import './mantine.css'
import '@mosaic/widgets/tokens.css'
import './app.css'
import { MantineProvider } from '@mantine/core'
import { MosaicClient } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { cssVariables, theme } from '@mosaic/widgets'
import { StrictMode } from 'react'
import { createRoot } from 'react-dom/client'
import { BrowserRouter } from 'react-router-dom'
import { App } from './App'
import { takeAddressCode } from './session/addressCodes'

const root = document.getElementById('root')
if (root === null) throw new Error('index.html has no #root')

const code = takeAddressCode(window)
const client = new MosaicClient()

createRoot(root).render(
  <StrictMode>
    <MantineProvider theme={theme} cssVariablesResolver={cssVariables} defaultColorScheme="auto">
      <MosaicProvider client={client}>
        <BrowserRouter>
          <App code={code} />
        </BrowserRouter>
      </MosaicProvider>
    </MantineProvider>
  </StrictMode>,
)
