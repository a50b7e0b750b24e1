/** Which way a peer connection takes: the selected candidate pair of a stats report. */
export interface ChosenPath {
  local: string
  remote: string
  protocol: string
  family: 'IPv4' | 'IPv6'
  localAddress: string
  remoteAddress: string
}

interface Entry {
  id?: string
  type?: string
  selectedCandidatePairId?: string
  selected?: boolean
  nominated?: boolean
  state?: string
  localCandidateId?: string
  remoteCandidateId?: string
  candidateType?: string
  protocol?: string
  relayProtocol?: string
  address?: string
  ip?: string
  port?: number
}

/** Null before ICE has chosen, and where the browser does not tell. */
export function chosenPath(report: ReadonlyMap<string, unknown>): ChosenPath | null {
  const { local, remote } = endsIn(report)
  if (local === undefined || remote === undefined) return null
  return {
    local: local.candidateType ?? '?',
    remote: remote.candidateType ?? '?',
    protocol: local.relayProtocol ?? local.protocol ?? '?',
    family: (remote.address ?? remote.ip ?? local.address ?? '').includes(':') ? 'IPv6' : 'IPv4',
    localAddress: addressOf(local),
    remoteAddress: addressOf(remote),
  }
}

/** `host → relay over UDP, IPv4: 192.0.2.7:5000 → …` */
export function pathText({ local, remote, protocol, family, localAddress, remoteAddress }: ChosenPath): string {
  return `${local} → ${remote} over ${protocol.toUpperCase()}, ${family}: ${localAddress} → ${remoteAddress}`
}

/** The other end's address on the path that is in use; null while unknown. */
export function remoteAddressIn(report: ReadonlyMap<string, unknown>): string | null {
  const { remote } = endsIn(report)
  return remote?.address ?? remote?.ip ?? null
}

function endsIn(report: ReadonlyMap<string, unknown>): { local?: Entry | undefined; remote?: Entry | undefined } {
  const entries = [...report.values()] as Entry[]
  const transport = entries.find(({ type, selectedCandidatePairId }) => type === 'transport' && selectedCandidatePairId !== undefined)
  const named = report.get(transport?.selectedCandidatePairId ?? '') as Entry | undefined
  // Firefox names no transport, but marks the pair.
  const pair = named ?? entries.find((entry) => entry.type === 'candidate-pair' && (entry.selected ?? isNominated(entry)))
  const candidate = (id = ''): Entry | undefined => report.get(id) as Entry | undefined
  return { local: candidate(pair?.localCandidateId), remote: candidate(pair?.remoteCandidateId) }
}

function isNominated({ nominated, state }: Entry): boolean {
  return nominated === true && state === 'succeeded'
}

// Browsers hide the address of host candidates from pages that may not use the microphone.
function addressOf({ address, ip, port }: Entry): string {
  const host = address ?? ip ?? ''
  if (host === '') return 'hidden'
  return `${host.includes(':') ? `[${host}]` : host}:${port ?? 0}`
}
