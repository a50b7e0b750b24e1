import { MantineProvider } from '@mantine/core'
import {
  BidirectionalStore,
  MosaicError,
  Value,
  writeConnectorConfig,
  type DescribedConnector,
  type MosaicClient,
  type RobotConnector,
  type RobotSummary,
} from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { act, cleanup, fireEvent, render, screen, within } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { DescribeRobot } from './DescribeRobot'
import { labelOf, travelText, widgetOfValue, withConnectors, withoutLabel } from './description'
import NotDescribed from './NotDescribed'
import { PATIENCE_MS } from './useTryOut'

const SCAN: DescribedConnector = { connectorId: 'scan', connectorType: 'turtlebot-sender-laser-scan' }
const CHECK: DescribedConnector[] = [
  { connectorId: 'L-receiver', connectorType: 'ConnectionCheckSenderStore' },
  { connectorId: 'L-sender', connectorType: 'ConnectionCheckReceiverStore' },
]

describe('a description', () => {
  test('takes a new word for a label in place of the old one, and both halves of a check as one', () => {
    const whole = { connectorId: 'L', connectorType: 'connection-check' }
    expect(withConnectors([...CHECK, SCAN], [whole]).map(labelOf)).toEqual(['scan', 'L'])
    expect(withoutLabel([...CHECK, SCAN], 'L')).toEqual([SCAN])
    expect(travelText(null)).toContain('not known')
  })

  test('of a value is the widget that understands it', () => {
    expect(widgetOfValue('json-r2u', { ranges: [1], angle_min: 0, angle_increment: 0.1 })).toBe('laser-scan')
    expect(widgetOfValue('json-r2u', { rpm: 7 })).toBeUndefined()
    expect(widgetOfValue('json-r2u', 7)).toBeUndefined()
  })
})

/** A server that keeps one robot, and a robot whose labels a test lets speak. */
class Site {
  robot: RobotSummary = { id: 'r', name: 'Rover', description: '', status: 2, authType: 1, organizationId: 'o', isOnline: true, connectorConfig: null }
  readonly saved: (readonly DescribedConnector[])[] = []
  readonly stores = new Map<string, BidirectionalStore>()
  readonly arrivedPictures = new Value<readonly string[]>([])
  refusal: MosaicError | null = null
  tabs: { id: string; name: string; widgets: string }[] = []

  readonly client = {
    api: {
      robot: () => Promise.resolve(this.robot),
      dashboardTabs: () => Promise.resolve(this.tabs.map(({ id, name }) => ({ id, name }))),
      dashboardTab: (id: string) => Promise.resolve(this.tabs.find((tab) => tab.id === id)),
    },
    describeRobot: (_robotId: string, connectors: readonly DescribedConnector[]) => {
      if (this.refusal) return Promise.reject(this.refusal)
      this.saved.push(connectors)
      return Promise.resolve()
    },
    connection: () => ({ arrivedPictures: this.arrivedPictures }),
    storeManager: {
      getOrCreateStore: (connector: RobotConnector) => {
        const store = this.stores.get(connector.connectorId) ?? new BidirectionalStore(connector)
        this.stores.set(connector.connectorId, store)
        return store
      },
      releaseStore: (connector: RobotConnector) => void this.stores.delete(connector.connectorId),
    },
  } as unknown as MosaicClient

  says(label: string, text: string): void {
    act(() => this.stores.get(label)?.notifySubscribers(new TextEncoder().encode(text).buffer))
  }

  show(robot: Partial<RobotSummary> = {}, Shown: typeof DescribeRobot = DescribeRobot): void {
    this.robot = { ...this.robot, ...robot }
    render(
      <MantineProvider env="test">
        <MosaicProvider client={this.client}>
          <Shown robot={this.robot} />
        </MosaicProvider>
      </MantineProvider>,
    )
  }
}

let site: Site

beforeEach(() => {
  site = new Site()
})

afterEach(() => {
  cleanup()
  vi.useRealTimers()
})

const form = () => within(screen.getByRole('form', { name: 'Describe a connector by hand' }))

describe('the page of a robot that nobody described', () => {
  test('leaves its place to the cards from the top on: who drives must see the picture', () => {
    const scrolled = vi.spyOn(window, 'scrollTo').mockImplementation(() => {})
    site.show({}, NotDescribed)
    expect(scrolled).not.toHaveBeenCalled()
    cleanup()
    expect(scrolled).toHaveBeenCalledExactlyOnceWith({ top: 0 })
    scrolled.mockRestore()
  })

  test('adds every connector of a pasted file', async () => {
    site.show()
    fireEvent.change(screen.getByLabelText('The robot’s YAML file'), { target: { value: 'connectors:\n  - { type: h1-camera, label: eye }\n  - { type: b }\n' } })
    expect((await screen.findByRole('alert')).textContent).toContain('line 3: the connector has no label')
    await userEvent.click(await screen.findByRole('button', { name: 'Add 1 connector' }))
    expect(site.saved).toEqual([[{ connectorId: 'eye', connectorType: 'h1-camera' }]])
    expect(screen.getByLabelText<HTMLTextAreaElement>('The robot’s YAML file').value).toBe('')
  })

  test('takes a file that is dropped on it', async () => {
    site.show()
    const file = new File(['connectors: [{ type: h1-camera, label: eye }]'], 'mosaic_config.yaml')
    fireEvent.drop(screen.getByLabelText('The robot’s YAML file'), { dataTransfer: { files: [file] } })
    expect(await screen.findByRole('button', { name: 'Add 1 connector' })).toBeTruthy()
  })

  test('keeps what was pasted when the server refuses, and says why', async () => {
    site.refusal = new MosaicError('auth.forbidden', 'observers of a robot may not describe it')
    site.show()
    fireEvent.change(screen.getByLabelText('The robot’s YAML file'), { target: { value: 'connectors: [{ type: h1-camera, label: eye }]' } })
    await userEvent.click(await screen.findByRole('button', { name: 'Add 1 connector' }))
    expect(screen.getByRole('alert').textContent).toContain('observers of a robot may not describe it')
    expect(screen.getByLabelText<HTMLTextAreaElement>('The robot’s YAML file').value).toContain('eye')
  })

  test('takes a known type at its word, and offers it while it is typed', async () => {
    site.show()
    await userEvent.type(form().getByLabelText(/Label/), 'base')
    await userEvent.type(form().getByLabelText(/^Type/, { selector: 'input' }), 'Twist')
    expect(await screen.findByRole('option', { name: /ros2-receiver-geometry-TwistStamped/ })).toBeTruthy()
    await userEvent.click(screen.getByRole('option', { name: /geometry-Twist / }))
    await userEvent.click(form().getByRole('button', { name: 'Add' }))
    expect(site.saved).toEqual([[{ connectorId: 'base', connectorType: 'ros2-receiver-geometry-Twist' }]])
  })

  test('adds nothing of which nobody knows what travels there', async () => {
    site.show()
    await userEvent.type(form().getByLabelText(/Label/), 'base')
    expect(form().getByRole<HTMLButtonElement>('button', { name: 'Add' }).disabled).toBe(true)
    await userEvent.selectOptions(form().getByLabelText(/What travels there/), 'json-u2r')
    await userEvent.selectOptions(form().getByLabelText(/Shown as/), 'drive-pad')
    await userEvent.click(form().getByRole('button', { name: 'Add' }))
    expect(site.saved[0]).toEqual([{ connectorId: 'base', connectorType: '', dataType: 'json-u2r', widget: 'drive-pad' }])
  })

  test('offers the pictures that arrive, and what tabs name', async () => {
    const connectors = [{ robotId: 'r', connectorId: 'L-receiver' }, { robotId: 'r', connectorId: 'L-sender' }]
    site.tabs = [{ id: 't', name: 'Lab', widgets: JSON.stringify({ widgets: [{ type: 'ConnectionCheck', connectors }] }) }]
    site.arrivedPictures.set(['front'])
    site.show()
    await userEvent.click(await screen.findByRole('button', { name: 'Add L' }))
    await userEvent.click(screen.getByRole('button', { name: 'Add front' }))
    expect(site.saved).toEqual([CHECK, [{ connectorId: 'front', connectorType: '', dataType: 'media' }]])
  })
})

describe('a try-out', () => {
  const tryLabel = (label: string) => {
    site.show()
    fireEvent.change(form().getByLabelText(/Label/), { target: { value: label } })
    fireEvent.click(form().getByRole('button', { name: 'Try this label' }))
  }

  test('tells what comes, fills the form, and sends nothing', () => {
    tryLabel('sonar')
    const sent = vi.spyOn(BidirectionalStore.prototype, 'sendData')
    site.says('sonar', '{"ranges":[1,2],"angle_min":0,"angle_increment":0.1}')
    expect(form().getByRole('status').textContent).toContain('JSON from the robot')
    expect(form().getByLabelText<HTMLSelectElement>(/What travels there/).value).toBe('json-r2u')
    expect(form().getByLabelText<HTMLSelectElement>(/Shown as/).value).toBe('laser-scan')
    expect(sent).not.toHaveBeenCalled()
  })

  test('hears numbered channels', () => {
    tryLabel('cloud')
    site.says('cloud-0', '\u0000\u0001')
    expect(form().getByRole('status').textContent).toContain('Bytes from the robot on the numbered channel ‘cloud-0’')
    expect(form().getByLabelText<HTMLInputElement>(/Numbered channels/).value).toBe('1')
  })

  test('lets nobody add numbered channels without their count', () => {
    tryLabel('cloud')
    site.says('cloud-0', '\u0000\u0001')
    const add = form().getByRole<HTMLButtonElement>('button', { name: 'Add' })
    expect(add.disabled).toBe(false)
    fireEvent.change(form().getByLabelText(/Numbered channels/), { target: { value: '0' } })
    expect(add.disabled).toBe(true)
    expect(screen.getByText(/say how many\.$/)).toBeTruthy()
  })

  test('of one label says nothing of another', () => {
    tryLabel('cloud')
    site.says('cloud-0', '\u0000\u0001')
    fireEvent.change(form().getByLabelText(/Label/), { target: { value: 'odom' } })
    expect(form().queryByRole('status')).toBeNull()
    expect(form().getByLabelText<HTMLSelectElement>(/What travels there/).value).toBe('')
    expect(form().queryByLabelText(/Numbered channels/)).toBeNull()
  })

  test('sees a picture', () => {
    site.arrivedPictures.set(['front'])
    tryLabel('front')
    expect(form().getByRole('status').textContent).toContain('Video from the robot')
  })

  test('says that a drive would be silent', () => {
    vi.useFakeTimers()
    tryLabel('cmd_vel')
    expect(form().getByRole('status').textContent).toContain('Listening')
    act(() => void vi.advanceTimersByTime(PATIENCE_MS))
    expect(form().getByRole('status').textContent).toContain('only receives there')
  })
})

describe('what is described', () => {
  const described = { connectorConfig: writeConnectorConfig([...CHECK, SCAN]), connectorConfigIsStored: true }

  test('is listed, each card once, and can be forgotten', async () => {
    site.show(described)
    const list = within(screen.getByRole('list', { name: 'Described connectors' }))
    expect(list.getAllByRole('listitem').map((row) => row.querySelector('strong')?.textContent)).toEqual(['L', 'scan'])
    await userEvent.click(list.getByRole('button', { name: 'Forget L' }))
    expect(site.saved[0]?.map(({ connectorId }) => connectorId)).toEqual(['scan'])
  })

  test('is kept when somebody else added to it meanwhile', async () => {
    site.show(described)
    site.robot = { ...site.robot, connectorConfig: writeConnectorConfig([SCAN, { connectorId: 'eye', connectorType: 'h1-camera' }]) }
    await userEvent.click(screen.getByRole('button', { name: 'Forget scan' }))
    expect(site.saved[0]?.map(({ connectorId }) => connectorId)).toEqual(['eye'])
  })

  test('is shown to an observer, who is told that it is not his to change', () => {
    site.show({ ...described, myRole: 'observer' })
    expect(screen.getByRole('note').textContent).toContain('can’t change it')
    expect(screen.getByRole('list', { name: 'Described connectors' }).textContent).toContain('scan')
    expect(screen.queryAllByRole('button')).toEqual([])
  })
})
