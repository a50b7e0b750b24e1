import { MantineProvider } from '@mantine/core'
import { MosaicError, type MosaicClient, type Organization, type Role, type RoleOnRobot } from '@mosaic/client'
import { MosaicProvider } from '@mosaic/react'
import { cleanup, render, screen, waitFor } from '@testing-library/react'
import userEvent from '@testing-library/user-event'
import { afterEach, beforeEach, expect, test } from 'vitest'
import { foundAccounts } from './grants'
import GrantsDialog from './GrantsDialog'

const account = (name: string, rest: Partial<RoleOnRobot> = {}): RoleOnRobot => ({
  accountId: name,
  email: `${name.toLowerCase()}@example.org`,
  fullName: name,
  isActive: true,
  isProgram: false,
  isOrganizationAdmin: false,
  role: 'operator',
  isGranted: false,
  ...rest,
})

class FakeApi {
  accounts = [account('Ada', { isOrganizationAdmin: true, role: 'supervisor' }), account('Bob')]
  mine: Organization = { id: 'o', name: 'Lab', defaultRole: 'operator' }
  refusal: MosaicError | null = null
  readonly said: unknown[] = []
  rolesOnRobot = () => Promise.resolve(this.accounts)
  organization = () => Promise.resolve(this.mine)
  setRoleOnRobot = (robotId: string, accountId: string, role: Role | null) => {
    this.said.push([robotId, accountId, role])
    if (this.refusal !== null) return Promise.reject(this.refusal)
    return Promise.resolve({ ...account(accountId), role: role ?? 'operator', isGranted: role !== null })
  }
  setDefaultRole = (defaultRole: Role) => {
    this.said.push(['default', defaultRole])
    return Promise.resolve({ ...this.mine, defaultRole })
  }
}

let api: FakeApi

beforeEach(() => {
  api = new FakeApi()
})
afterEach(cleanup)

async function shown(): Promise<void> {
  render(
    <MantineProvider env="test">
      <MosaicProvider client={{ api } as unknown as MosaicClient}>
        <GrantsDialog robotId="r" name="Robbie" onClose={() => {}} />
      </MosaicProvider>
    </MantineProvider>,
  )
  await screen.findByRole('list', { name: 'Accounts' })
}

const roleOf = (name: string) => screen.getByLabelText<HTMLSelectElement>(`Role of ${name}`)

test('who may do what is shown, with the default of each', async () => {
  await shown()
  expect(roleOf('Ada').selectedOptions[0]?.textContent).toBe('Default (Supervisor)')
  expect(roleOf('Bob').selectedOptions[0]?.textContent).toBe('Default (Operator)')
})

test('a role is granted and taken back', async () => {
  await shown()
  await userEvent.selectOptions(roleOf('Bob'), 'observer')
  await waitFor(() => expect(roleOf('Bob').value).toBe('observer'))
  await userEvent.selectOptions(roleOf('Bob'), 'default')
  await waitFor(() => expect(roleOf('Bob').value).toBe('default'))
  expect(api.said).toEqual([
    ['r', 'Bob', 'observer'],
    ['r', 'Bob', null],
  ])
})

test('what the server refuses is said, and nothing changes', async () => {
  api.refusal = new MosaicError('auth.forbidden', 'robot would be left without a supervisor')
  await shown()
  await userEvent.selectOptions(roleOf('Ada'), 'observer')
  expect((await screen.findByRole('alert')).textContent).toContain('without a supervisor')
  expect(roleOf('Ada').value).toBe('default')
})

test('the default of the organization can be changed', async () => {
  await shown()
  await userEvent.selectOptions(screen.getByLabelText('Default role of the organization'), 'observer')
  expect(api.said).toEqual([['default', 'observer']])
})

test('accounts are found by name, address and role', () => {
  const accounts = [account('Ada', { role: 'supervisor' }), account('Bob')]
  expect(foundAccounts(accounts, 'SUPER example').map(({ fullName }) => fullName)).toEqual(['Ada'])
  expect(foundAccounts(accounts, '')).toHaveLength(2)
})
