// Type-checks the projects that are named, and the types inside our packages with them. Those inside other packages are
// read and not judged: that is their makers' work, and takes three times as long as all the rest.
import process from 'node:process'
import ts from 'typescript'

const parsed = new Map()

function problemsOf(project) {
  const { options, fileNames, errors } = ts.parseJsonConfigFileContent(ts.readConfigFile(project, ts.sys.readFile).config, ts.sys, '.')
  const program = ts.createProgram(fileNames, options, hostOf(options))
  const judged = program.getSourceFiles().filter(({ fileName }) => /node_modules\/@mosaic\//.test(fileName) || !/node_modules\//.test(fileName))
  const found = judged.flatMap((file) => [...program.getSyntacticDiagnostics(file), ...program.getSemanticDiagnostics(file)])
  return [...errors, ...program.getOptionsDiagnostics(), ...program.getGlobalDiagnostics(), ...found]
}

/** What all projects read is parsed once. */
function hostOf(options) {
  const host = ts.createCompilerHost(options)
  const read = host.getSourceFile.bind(host)
  host.getSourceFile = (path, ...more) => {
    if (!parsed.has(path)) parsed.set(path, read(path, ...more))
    return parsed.get(path)
  }
  return host
}

const problems = process.argv.slice(2).flatMap(problemsOf)
const words = { getCanonicalFileName: (name) => name, getCurrentDirectory: () => '.', getNewLine: () => '\n' }
process.stderr.write(ts.formatDiagnostics(problems, words))
process.exit(problems.length === 0 ? 0 : 1)
