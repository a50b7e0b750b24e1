import { browserPlatform } from '@mosaic/client'
import { RestApi } from '@mosaic/client/parts'
import { useMosaicClient } from '@mosaic/react'
import { camera, browserGetUserMedia, type CameraChoice, type PageRobot } from '@mosaic/robot'
import { useCallback, useEffect, useRef, useState } from 'react'
import { type Failure, failureOf } from '@mosaic/widgets'
import { askFor, FIRST_CHOICES, robotOf, type Choices } from './choices'
import { forgetRobot, rememberedRobot, rememberRobot, type RememberedRobot } from './rememberedRobot'

export interface Share {
  /** What runs; null: nothing is shared. */
  robot: PageRobot | null
  /** The robot that this browser is, once it is one. */
  known: RememberedRobot | null
  isBusy: boolean
  failure: Failure | null
  start: (name: string, choices: Choices) => Promise<void>
  stop: () => void
  /** Be another robot the next time. */
  forget: () => void
  /** How the camera films, or would. */
  camera: CameraChoice
  film: (choice: CameraChoice) => void
}

/** Makes a robot of this device while somebody shares it. `code`: the one-time code that the page was opened with. */
export function useShare(code: string | null): Share {
  const account = useAccount(code)
  const [robot, setRobot] = useState<PageRobot | null>(null)
  const [known, setKnown] = useState(rememberedRobot)
  const [choice, setChoice] = useState(FIRST_CHOICES.camera)
  const [isBusy, setIsBusy] = useState(false)
  const [failure, setFailure] = useState<Failure | null>(null)

  const start = useCallback(
    async (name: string, choices: Choices) => {
      setIsBusy(true)
      setFailure(null)
      try {
        const { granted, problems } = await askFor(choices)
        const mine = rememberedRobot() ?? (await made(await account(), name))
        setKnown(mine)
        const running = robotOf(mine, granted, browserPlatform())
        for (const [label, problem] of Object.entries(problems)) running.report(label, problem)
        running.start()
        setChoice(choices.camera)
        setRobot(running)
      } catch (error) {
        setFailure(failureOf(error))
      }
      setIsBusy(false)
    },
    [account],
  )
  const stop = useCallback(() => {
    robot?.stop()
    setRobot(null)
  }, [robot])
  const forget = useCallback(() => {
    forgetRobot()
    setKnown(null)
  }, [])
  const film = useCallback(
    (choice: CameraChoice) => {
      const getUserMedia = browserGetUserMedia()
      setChoice(choice)
      if (getUserMedia !== null) robot?.use(camera(choice, getUserMedia))
    },
    [robot],
  )
  useEndWith(robot, setRobot)
  return { robot, known, isBusy, failure, start, stop, forget, camera: choice, film }
}

/** Whoever leaves the page shares nothing any more; one that is looked at again tries what failed meanwhile. */
function useEndWith(robot: PageRobot | null, setRobot: (robot: null) => void): void {
  useEffect(() => {
    if (robot === null) return
    const left = () => {
      robot.stop()
      setRobot(null)
    }
    const looked = () => {
      if (document.visibilityState === 'visible') robot.wake()
    }
    window.addEventListener('pagehide', left)
    document.addEventListener('visibilitychange', looked)
    return () => {
      window.removeEventListener('pagehide', left)
      document.removeEventListener('visibilitychange', looked)
      robot.stop()
    }
  }, [robot, setRobot])
}

/** The REST interface as whoever makes the robot: of the code, which is used at once, else of who is signed in here. */
function useAccount(code: string | null): () => Promise<RestApi> {
  const client = useMosaicClient()
  const signIn = useRef<Promise<string> | null>(null)
  useEffect(() => {
    // It counts for a minute, and reading takes its time. Kept in memory alone: no account stays on the phone.
    if (code !== null) signIn.current ??= client.api.loginWithCode(code)
    signIn.current?.catch(() => {})
  }, [client, code])
  return useCallback(async () => {
    if (signIn.current === null) return client.api
    const token = await signIn.current
    return new RestApi(window.location.origin, () => token, (input, init) => fetch(input, init))
  }, [client])
}

async function made(api: RestApi, name: string): Promise<RememberedRobot> {
  const { id } = await api.createRobot({ name, description: 'A phone or computer that shares what it has' })
  const robot = { robotId: id, token: await api.newRobotToken(id), name }
  rememberRobot(robot)
  return robot
}
