import { Button, Modal, Stack, Text } from '@mantine/core'
import { useMosaicClient, useRobots } from '@mosaic/react'
import { IconDeviceLaptop } from '@tabler/icons-react'
import { useEffect, useState } from 'react'
import { Link } from 'react-router-dom'
import { type Failure, FailureAlert, failureOf } from '@mosaic/widgets'
import { SHARE_PATH } from '../share/sharePath'
import { isOwnMachine, QrCode } from './QrCode'
import classes from './robots.module.css'

export interface SharePhoneDialogProps {
  onClose: () => void
}

/** A code counts for a minute; the next one is there before. */
const CODE_PERIOD_MS = 45_000
const LOOK_PERIOD_MS = 1500

/** Makes a robot of the phone that scans it, or of this very computer. */
export default function SharePhoneDialog({ onClose }: SharePhoneDialogProps) {
  const { origin, hostname, protocol } = window.location
  const { code, failure } = useFreshCode()
  const come = useNewcomer()
  const isUnreachable = isOwnMachine(hostname)
  return (
    <Modal opened onClose={onClose} title="Use a phone as a robot" centered>
      <Stack>
        <Text size="sm">Its camera and sensors become a robot of yours. Scan this with the phone, then press “Start sharing” there.</Text>
        {failure !== null && <FailureAlert failure={failure} />}
        {isUnreachable ? (
          <p className={classes.hint} role="note">
            This page is open as <code>{hostname}</code>, which a phone can’t reach. Open it under a name that others reach, over https.
          </p>
        ) : (
          <>
            {protocol === 'http:' && (
              <p className={classes.hint} role="note">
                Over <code>http://</code> the browser of a phone gives a page neither camera nor sensors: the server needs https.
              </p>
            )}
            {code !== null && <QrCode text={`${origin}${SHARE_PATH}#code=${code}`} label="Link for the phone" />}
            <Text size="xs" c="dimmed">
              The code in it counts once, for a minute, and is made anew by itself. The phone keeps a token of that robot alone, nothing
              of your account.
            </Text>
          </>
        )}
        <div role="status">
          {come !== null && (
            <Button component={Link} to={`/robots/${encodeURIComponent(come.id)}`} fullWidth>
              {come.name} is here: see it
            </Button>
          )}
        </div>
        <Button component={Link} to={SHARE_PATH} variant="default" leftSection={<IconDeviceLaptop size={16} aria-hidden />}>
          Use this device instead
        </Button>
      </Stack>
    </Modal>
  )
}

function useFreshCode(): { code: string | null; failure: Failure | null } {
  const client = useMosaicClient()
  const [state, setState] = useState<{ code: string | null; failure: Failure | null }>({ code: null, failure: null })
  useEffect(() => {
    let isMounted = true
    const issue = () =>
      void client.api
        .issueCode()
        .then((code) => ({ code, failure: null }))
        .catch((error: unknown) => ({ code: null, failure: failureOf(error) }))
        .then((next) => isMounted && setState(next))
    issue()
    const timer = setInterval(issue, CODE_PERIOD_MS)
    return () => {
      isMounted = false
      clearInterval(timer)
    }
  }, [client])
  return state
}

/** A robot that has come online since this was opened. */
function useNewcomer(): { id: string; name: string } | null {
  const client = useMosaicClient()
  const robots = useRobots()
  const [before] = useState(() => new Set(robots.filter(({ isOnline }) => isOnline).map(({ id }) => id)))
  useEffect(() => {
    // One that is made elsewhere is not announced; a failure is the page's own to tell.
    const timer = setInterval(() => void client.refreshRobots().catch(() => {}), LOOK_PERIOD_MS)
    return () => clearInterval(timer)
  }, [client])
  return robots.find(({ id, isOnline }) => isOnline && !before.has(id)) ?? null
}
