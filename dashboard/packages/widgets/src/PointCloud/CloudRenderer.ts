/** Draws one cloud, a grid on the ground and the axes of its frame, with WebGL 2. Knows nothing of pages and pointers. */
import { viewProjection, type Camera } from './camera'
import type { Extremes } from './cloudExtent'
import type { PointCloud } from '../clouds/compactCloud'
import { gridLines } from './gridLines'
import { LINE_FRAGMENT, LINE_VERTEX, POINT_FRAGMENT, POINT_VERTEX } from './shaders'

export const COLOUR_MODES = ['height', 'distance', 'intensity', 'rgb'] as const
export type ColourMode = (typeof COLOUR_MODES)[number]

export interface Style {
  mode: ColourMode
  span: Extremes
  /** In pixels of the canvas. */
  pointSize: number
  /** Red, green, blue of the grid, 0 to 1. */
  grid: readonly [number, number, number]
}

interface Program {
  program: WebGLProgram
  at: (name: string) => WebGLUniformLocation | null
}

export class CloudRenderer {
  private readonly points: Program
  private readonly lines: Program
  private readonly pointArray: WebGLVertexArrayObject
  private readonly lineArray: WebGLVertexArrayObject
  private readonly buffers: { positions: WebGLBuffer; intensities: WebGLBuffer; colours: WebGLBuffer; lines: WebGLBuffer }
  private cloud: PointCloud | null = null
  private lineCount = 0
  private lineKey = ''

  /** Throws where the programs can't be made. */
  constructor(private readonly gl: WebGL2RenderingContext) {
    this.points = programOf(gl, POINT_VERTEX, POINT_FRAGMENT)
    this.lines = programOf(gl, LINE_VERTEX, LINE_FRAGMENT)
    const buffer = () => gl.createBuffer()
    this.buffers = { positions: buffer(), intensities: buffer(), colours: buffer(), lines: buffer() }
    this.pointArray = gl.createVertexArray()
    this.lineArray = gl.createVertexArray()
    gl.bindVertexArray(this.pointArray)
    attribute(gl, this.buffers.positions, 0, 3, gl.FLOAT, false, 0, 0)
    attribute(gl, this.buffers.intensities, 1, 1, gl.UNSIGNED_BYTE, true, 0, 0)
    attribute(gl, this.buffers.colours, 2, 3, gl.UNSIGNED_BYTE, true, 0, 0)
    gl.bindVertexArray(this.lineArray)
    attribute(gl, this.buffers.lines, 0, 3, gl.FLOAT, false, 28, 0)
    attribute(gl, this.buffers.lines, 1, 4, gl.FLOAT, false, 28, 12)
    gl.bindVertexArray(null)
    gl.enable(gl.DEPTH_TEST)
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA)
  }

  /** The cloud to draw from now on. */
  show(cloud: PointCloud): void {
    const { gl, buffers } = this
    this.cloud = cloud
    fill(gl, buffers.positions, cloud.positions)
    gl.bindVertexArray(this.pointArray)
    for (const [location, buffer, data] of [[1, buffers.intensities, cloud.intensities], [2, buffers.colours, cloud.colours]] as const) {
      if (data === null) {
        gl.disableVertexAttribArray(location)
      } else {
        fill(gl, buffer, data)
        gl.enableVertexAttribArray(location)
      }
    }
    gl.bindVertexArray(null)
  }

  draw(camera: Camera, style: Style): void {
    const { gl } = this
    const { width, height } = gl.canvas
    gl.viewport(0, 0, width, height)
    gl.clearColor(0, 0, 0, 0)
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT)
    const aspect = width / Math.max(1, height)
    this.drawLines(camera, style, aspect)
    this.drawPoints(camera, style, aspect)
  }

  dispose(): void {
    const { gl } = this
    for (const buffer of Object.values(this.buffers)) gl.deleteBuffer(buffer)
    for (const array of [this.pointArray, this.lineArray]) gl.deleteVertexArray(array)
    for (const { program } of [this.points, this.lines]) gl.deleteProgram(program)
  }

  private drawPoints(camera: Camera, style: Style, aspect: number): void {
    const { gl, cloud } = this
    if (cloud === null || cloud.count === 0) return
    const { program, at } = this.points
    gl.useProgram(program)
    gl.uniformMatrix4fv(at('view'), false, viewProjection(camera, aspect, cloud.origin))
    gl.uniform3f(at('origin'), ...(cloud.origin as [number, number, number]))
    gl.uniform2f(at('span'), ...(style.span as [number, number]))
    gl.uniform1i(at('mode'), ['height', 'distance', 'intensity', 'rgb'].indexOf(style.mode))
    gl.uniform1f(at('size'), style.pointSize)
    gl.bindVertexArray(this.pointArray)
    gl.drawArrays(gl.POINTS, 0, cloud.count)
    gl.bindVertexArray(null)
  }

  private drawLines(camera: Camera, { grid }: Style, aspect: number): void {
    const { gl } = this
    const lines = gridLines(camera, grid)
    if (lines.key !== this.lineKey) {
      this.lineKey = lines.key
      const vertices = lines.vertices()
      this.lineCount = vertices.length / 7
      fill(gl, this.buffers.lines, vertices)
    }
    gl.useProgram(this.lines.program)
    gl.uniformMatrix4fv(this.lines.at('view'), false, viewProjection(camera, aspect))
    gl.bindVertexArray(this.lineArray)
    gl.enable(gl.BLEND)
    gl.depthMask(false) // lines are never in front of points
    gl.drawArrays(gl.LINES, 0, this.lineCount)
    gl.depthMask(true)
    gl.disable(gl.BLEND)
    gl.bindVertexArray(null)
  }
}

function programOf(gl: WebGL2RenderingContext, vertex: string, fragment: string): Program {
  const program = gl.createProgram()
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]] as const) {
    const shader = gl.createShader(type)
    if (shader === null) throw new Error('the graphics context is lost')
    gl.shaderSource(shader, source)
    gl.compileShader(shader)
    gl.attachShader(program, shader)
    gl.deleteShader(shader)
  }
  gl.linkProgram(program)
  if (gl.getProgramParameter(program, gl.LINK_STATUS) !== true) {
    throw new Error(gl.getProgramInfoLog(program) ?? 'the shaders cannot be linked')
  }
  const places = new Map<string, WebGLUniformLocation | null>()
  const at = (name: string) => {
    if (!places.has(name)) places.set(name, gl.getUniformLocation(program, name))
    return places.get(name) ?? null
  }
  return { program, at }
}

function attribute(
  gl: WebGL2RenderingContext,
  buffer: WebGLBuffer,
  location: number,
  count: number,
  type: number,
  isShare: boolean,
  stride: number,
  offset: number,
): void {
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer)
  gl.enableVertexAttribArray(location)
  gl.vertexAttribPointer(location, count, type, isShare, stride, offset)
}

function fill(gl: WebGL2RenderingContext, buffer: WebGLBuffer, data: Float32Array<ArrayBuffer> | Uint8Array<ArrayBuffer>): void {
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer)
  gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW)
}
