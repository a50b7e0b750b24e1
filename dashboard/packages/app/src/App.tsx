import { Center, Loader } from '@mantine/core'
import { useMosaicClient, useReadable } from '@mosaic/react'
import { lazy, Suspense, useState } from 'react'
import { Navigate, Route, Routes, useLocation } from 'react-router-dom'
import { PageBoundary } from './PageBoundary'
import { RobotListPage } from './robots/RobotListPage'
import type { AddressCode } from './session/addressCodes'
import { failureOf } from '@mosaic/widgets'
import { ReplaceSession } from './session/ReplaceSession'
import { ServerAwayPage } from './session/ServerAwayPage'
import { SignInPage } from './session/SignInPage'
import { useFirstSignIn } from './session/useFirstSignIn'
import { rememberedRobot } from './share/rememberedRobot'
import { SHARE_PATH } from './share/sharePath'
import { useAhead } from './shell/useAhead'

const loadCheckPage = () => import('./check/CheckPage')
const CheckPage = lazy(loadCheckPage)
const SharePage = lazy(() => import('./share/SharePage'))
// With every widget: whoever only signs in doesn't wait for it, whoever looks at a list with robots has it when he chooses one.
const loadRobotPage = () => import('./robot/RobotPage')
const RobotPage = lazy(() => loadRobotPage().then((page) => ({ default: page.RobotPage })))
/** What works without the server and is asked for when it has gone: only if it was fetched before. */
const AHEAD = [loadCheckPage, () => import('./connection/ConnectionDetails'), () => import('./journal/JournalDrawer')]

export interface AppProps {
  /** The code that the page was opened with. */
  code: AddressCode | null
}

export function App({ code }: AppProps) {
  const isSharing = useLocation().pathname === SHARE_PATH
  // Whoever scans it to share a phone is not signed in there: the code makes one robot, and is forgotten.
  const [shareCode] = useState(() => (isSharing && code?.kind === 'code' ? code.value : null))
  const { isBusy, failure, asks, answer } = useFirstSignIn(shareCode === null ? code : null)
  const client = useMosaicClient()
  const session = useReadable(client.session)
  const ended = useReadable(client.sessionError)
  const shown = failure ?? (ended && failureOf(ended))
  if (asks) return <ReplaceSession failure={shown} isBusy={isBusy} onAnswer={answer} />
  if (isBusy) {
    return (
      <Center h="100dvh" role="status" aria-label="Signing in">
        <Loader size="sm" />
      </Center>
    )
  }
  if (isSharing && (session !== null || shareCode !== null || rememberedRobot() !== null)) {
    return (
      <PageBoundary>
        <Suspense>
          <SharePage code={shareCode} />
        </Suspense>
      </PageBoundary>
    )
  }
  if (session === null && client.remembersSession) return <ServerAwayPage failure={shown} />
  if (session === null) return <SignInPage firstFailure={shown} />
  return <SignedIn />
}

function SignedIn() {
  useAhead(AHEAD)
  return (
    <PageBoundary>
      <Suspense>
        <Routes>
          <Route path="/" element={<RobotListPage fetchRobotPage={loadRobotPage} />} />
          <Route path="/robots/:robotId" element={<RobotPage />} />
          <Route path="/check" element={<CheckPage />} />
          <Route path="*" element={<Navigate to="/" replace />} />
        </Routes>
      </Suspense>
    </PageBoundary>
  )
}
