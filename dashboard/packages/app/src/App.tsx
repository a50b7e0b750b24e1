import { Center, Loader } from '@mantine/core'
import { useMosaicClient, useReadable, useRobots } from '@mosaic/react'
import { Navigate, Route, Routes } from 'react-router-dom'
import { RobotPage } from './robot/RobotPage'
import { RobotListPage } from './robots/RobotListPage'
import { SignInPage } from './session/SignInPage'
import { useOneTimeCode } from './session/useOneTimeCode'

export interface AppProps {
  /** The one-time code that the page was opened with. */
  code: string | null
}

export function App({ code }: AppProps) {
  const { isBusy, failure, hasSignedIn } = useOneTimeCode(code)
  const session = useReadable(useMosaicClient().session)
  if (isBusy) {
    return (
      <Center h="100dvh" aria-label="Signing in">
        <Loader size="sm" />
      </Center>
    )
  }
  if (session === null) return <SignInPage codeFailure={failure} />
  return (
    <Routes>
      <Route path="/" element={hasSignedIn ? <FirstPage /> : <RobotListPage />} />
      <Route path="/robots/:robotId" element={<RobotPage />} />
      <Route path="*" element={<Navigate to="/" replace />} />
    </Routes>
  )
}

let hasLedOn = false

/** Whoever comes with a code wants to drive: with one robot there is nothing to choose. Once, so that Back works. */
function FirstPage() {
  const robots = useRobots()
  const only = robots.length === 1 ? robots[0] : undefined
  if (only === undefined || hasLedOn) return <RobotListPage />
  return <LedOn to={`/robots/${encodeURIComponent(only.id)}`} />
}

function LedOn({ to }: { to: string }) {
  hasLedOn = true
  return <Navigate to={to} />
}
