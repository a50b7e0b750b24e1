import type { Organization, Role, RoleOnRobot } from '@mosaic/client'
import { useMosaicClient } from '@mosaic/react'
import { useEffect, useState } from 'react'
import { type Failure, failureOf } from '@mosaic/widgets'

export interface GrantsView {
  accounts: readonly RoleOnRobot[] | null
  organization: Organization | null
  failure: Failure | null
  /** Account whose change is under way; `''` the organization's default; null none. */
  changing: string | null
  grant: (accountId: string, role: Role | null) => Promise<void>
  setDefault: (role: Role) => Promise<void>
}

/** The roles on one robot, and changing them. What the server refuses is shown, and nothing changes. */
export function useGrants(robotId: string): GrantsView {
  const { api } = useMosaicClient()
  const [accounts, setAccounts] = useState<readonly RoleOnRobot[] | null>(null)
  const [organization, setOrganization] = useState<Organization | null>(null)
  const [failure, setFailure] = useState<Failure | null>(null)
  const [changing, setChanging] = useState<string | null>(null)
  useEffect(() => {
    let isShown = true
    Promise.all([api.rolesOnRobot(robotId), api.organization()]).then(
      ([roles, mine]) => {
        if (!isShown) return
        setAccounts(roles)
        setOrganization(mine)
      },
      (error: unknown) => isShown && setFailure(failureOf(error)),
    )
    return () => {
      isShown = false
    }
  }, [api, robotId])
  const change = async (what: string, work: () => Promise<void>) => {
    setChanging(what)
    setFailure(null)
    try {
      await work()
    } catch (error) {
      setFailure(failureOf(error))
    }
    setChanging(null)
  }
  return {
    accounts,
    organization,
    failure,
    changing,
    grant: (accountId, role) =>
      change(accountId, async () => {
        const changed = await api.setRoleOnRobot(robotId, accountId, role)
        setAccounts((before) => before?.map((one) => (one.accountId === accountId ? changed : one)) ?? null)
      }),
    setDefault: (role) =>
      change('', async () => {
        setOrganization(await api.setDefaultRole(role))
        setAccounts(await api.rolesOnRobot(robotId))
      }),
  }
}
