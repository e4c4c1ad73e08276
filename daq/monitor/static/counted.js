// How a number of things is said, on the live page and at the desk alike.
export function counted(n, one, many = `${one}s`) { return `${n.toLocaleString("en")} ${n === 1 ? one : many}`; }
