import { Button, Center, Stack } from '@mantine/core'
import { useMosaicClient, useReadable } from '@mosaic/react'
import { Component, useEffect, useRef, type ReactNode } from 'react'
import { FailureAlert } from '@mosaic/widgets'

const MESSAGE = 'This page could not be shown'
const CURES = {
  away: 'The server is away. This page reloads by itself when it is back.',
  here: 'The server may be newer than the page that is open here: reload it.',
}

/** Says that a page can't be shown where nothing would be seen: mostly its script could not be fetched any more. */
export class PageBoundary extends Component<{ children: ReactNode }, { hasFailed: boolean }> {
  override state = { hasFailed: false }

  static getDerivedStateFromError(): { hasFailed: boolean } {
    return { hasFailed: true }
  }

  override render(): ReactNode {
    if (!this.state.hasFailed) return this.props.children
    return <NotShown />
  }
}

function NotShown() {
  const isServerHere = useReadable(useMosaicClient().server) === 'online'
  useReloadOnReturn(isServerHere)
  return (
    <Center h="100dvh" p="md">
      <Stack maw={480}>
        <FailureAlert failure={{ code: '', message: MESSAGE, cure: isServerHere ? CURES.here : CURES.away }} />
        <Button onClick={() => location.reload()}>Reload</Button>
      </Stack>
    </Center>
  )
}

/** A browser may keep that it got nothing: only a new page asks for everything again. */
function useReloadOnReturn(isServerHere: boolean): void {
  const wasAway = useRef(false)
  useEffect(() => {
    if (isServerHere && wasAway.current) location.reload()
    wasAway.current = !isServerHere
  }, [isServerHere])
}
