// Runs flight.py in Pyodide: node webassembly.mjs PYODIDE TOP SAMPLES OTHERS
const [pyodide, top, samples, others] = process.argv.slice(2);
const { loadPyodide } = await import(pyodide);
const python = await loadPyodide();
python.mountNodeFS("/tenbaud", top);
python.runPython("import sys; sys.dont_write_bytecode = True; sys.path.insert(0, '/tenbaud')");
const { report } = python.pyimport("benchmarks.bits.flight");
console.log(report(Number(samples), Number(others)));
